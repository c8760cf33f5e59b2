#include "spillikin/mesh/polygons.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

namespace spillikin::mesh {

void Polygons::add(std::span<const Id> polygon) {
  vertex.insert(vertex.end(), polygon.begin(), polygon.end());
  offset.push_back(static_cast<Id>(vertex.size()));
}

void Polygons::clear() {
  offset.assign(1, 0);
  vertex.clear();
}

namespace {

// Walks round the polygon; whenever a vertex comes again, the loop since its first visit is a polygon of its own.
void addSimpleLoops(std::span<const Id> polygon, Polygons& out) {
  std::vector<Id> path;
  for (const Id v : polygon) {
    const auto before = std::find(path.begin(), path.end(), v);
    if (before != path.end()) {
      if (path.end() - before >= 3) out.add({before, path.end()});
      path.erase(before, path.end());
    }
    path.push_back(v);
  }
  if (path.size() >= 3) out.add(path);
}

// Equal for polygons with the same corners in the same or the opposite round.
std::vector<Id> roundTrip(std::span<const Id> polygon) {
  std::vector<Id> result(polygon.begin(), polygon.end());
  std::rotate(result.begin(), std::min_element(result.begin(), result.end()), result.end());
  if (result.back() < result[1]) std::reverse(result.begin() + 1, result.end());
  return result;
}

struct EdgeUse {
  Id low, high;
  Id polygon;
  bool upward;  // the polygon goes from low to high
};

std::vector<EdgeUse> edgeUses(const Polygons& polygons) {
  std::vector<EdgeUse> uses;
  uses.reserve(polygons.vertex.size());
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    const auto polygon = polygons[i];
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Id a = polygon[k], b = polygon[k + 1 < polygon.size() ? k + 1 : 0];
      uses.push_back({std::min(a, b), std::max(a, b), static_cast<Id>(i), a < b});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& p, const EdgeUse& q) {
    return std::tie(p.low, p.high, p.polygon) < std::tie(q.low, q.high, q.polygon);
  });
  return uses;
}

// Calls visit(uses of one edge) for every edge.
template <class Visit>
void forEachEdge(const std::vector<EdgeUse>& uses, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
    while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high)
      ++end;
    visit(std::span<const EdgeUse>(uses).subspan(begin, end - begin));
  }
}

bool balanced(const Polygons& polygons) {
  bool result = polygons.size() > 0;
  forEachEdge(edgeUses(polygons), [&](std::span<const EdgeUse> edge) {
    const auto up = std::count_if(edge.begin(), edge.end(), [](const EdgeUse& use) { return use.upward; });
    result = result && 2 * static_cast<std::size_t>(up) == edge.size();
  });
  return result;
}

}  // namespace

Polygons reduced(const Polygons& polygons) {
  Polygons simple;
  for (std::size_t i = 0; i < polygons.size(); ++i)
    addSimpleLoops(polygons[i], simple);
  std::map<std::vector<Id>, std::vector<std::size_t>> same;
  for (std::size_t i = 0; i < simple.size(); ++i)
    same[roundTrip(simple[i])].push_back(i);
  std::vector<std::uint8_t> keep(simple.size(), 0);
  for (const auto& [corners, which] : same) {
    if (which.size() % 2 == 1) keep[which.front()] = 1;
  }
  Polygons result;
  for (std::size_t i = 0; i < simple.size(); ++i) {
    if (keep[i] != 0) result.add(simple[i]);
  }
  return result;
}

bool orientTogether(Polygons& polygons) {
  if (balanced(polygons)) return true;
  // Neighbours over edges of just two polygons, and whether one of the two is the wrong way round.
  std::vector<std::vector<std::pair<Id, bool>>> neighbours(polygons.size());
  forEachEdge(edgeUses(polygons), [&](std::span<const EdgeUse> edge) {
    if (edge.size() != 2) return;
    const bool clash = edge[0].upward == edge[1].upward;
    neighbours[edge[0].polygon].emplace_back(edge[1].polygon, clash);
    neighbours[edge[1].polygon].emplace_back(edge[0].polygon, clash);
  });
  std::vector<std::int8_t> turned(polygons.size(), -1);
  std::vector<Id> stack;
  for (Id seed = 0; seed < polygons.size(); ++seed) {
    if (turned[seed] >= 0) continue;
    turned[seed] = 0;
    stack.push_back(seed);
    while (!stack.empty()) {
      const Id at = stack.back();
      stack.pop_back();
      for (const auto& [next, clash] : neighbours[at]) {
        if (turned[next] >= 0) continue;
        turned[next] = static_cast<std::int8_t>(clash ? 1 - turned[at] : turned[at]);
        stack.push_back(next);
      }
    }
  }
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    if (turned[i] == 1) std::reverse(polygons[i].begin(), polygons[i].end());
  }
  return balanced(polygons);
}

std::vector<Polygons> parts(const Polygons& polygons) {
  std::vector<Id> group(polygons.size());
  std::iota(group.begin(), group.end(), Id{0});
  const auto root = [&](Id i) {
    while (group[i] != i)
      i = group[i] = group[group[i]];
    return i;
  };
  forEachEdge(edgeUses(polygons), [&](std::span<const EdgeUse> edge) {
    for (const EdgeUse& use : edge) {
      const Id a = root(edge[0].polygon), b = root(use.polygon);
      group[std::max(a, b)] = std::min(a, b);
    }
  });
  std::map<Id, Polygons> found;
  for (Id i = 0; i < polygons.size(); ++i)
    found[root(i)].add(polygons[i]);
  std::vector<Polygons> result;
  result.reserve(found.size());
  for (auto& [first, part] : found)
    result.push_back(std::move(part));
  return result;
}

namespace {

std::vector<Id> distinctVertices(const Polygons& polygons) {
  std::vector<Id> vertices = polygons.vertex;
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

bool contains(std::span<const Id> polygon, Id vertex) {
  return std::find(polygon.begin(), polygon.end(), vertex) != polygon.end();
}

// A polygon and an apex that all other polygons, triangles, share: a tetrahedron or a pyramid.
std::optional<std::vector<Id>> recogniseCone(const Polygons& polygons, std::size_t base,
                                             const std::vector<Id>& vertices) {
  const auto apex = std::find_if(vertices.begin(), vertices.end(), [&](Id v) { return !contains(polygons[base], v); });
  if (apex == vertices.end()) return std::nullopt;
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    if (i != base && (polygons[i].size() != 3 || !contains(polygons[i], *apex))) return std::nullopt;
  }
  std::vector<Id> result(polygons[base].rbegin(), polygons[base].rend());
  result.push_back(*apex);
  return result;
}

// The other end of the side edge at base[k]: the quadrilateral beyond the base's edge k goes base[k + 1], base[k], it.
std::optional<Id> sideEnd(const Polygons& polygons, std::size_t base, std::size_t k) {
  const auto bottom = polygons[base];
  const Id from = bottom[(k + 1) % bottom.size()], to = bottom[k];
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    if (i == base || polygons[i].size() != 4) continue;
    for (std::size_t c = 0; c < 4; ++c) {
      if (polygons[i][c] == from && polygons[i][(c + 1) % 4] == to) return polygons[i][(c + 2) % 4];
    }
  }
  return std::nullopt;
}

// A prism over the polygon `base`: bottom round, then the top in the same order.
std::optional<std::vector<Id>> recognisePrism(const Polygons& polygons, std::size_t base) {
  const auto bottom = polygons[base];
  const std::size_t n = bottom.size();
  std::vector<Id> result(bottom.begin(), bottom.end());
  for (std::size_t k = 0; k < n; ++k) {
    const std::optional<Id> top = sideEnd(polygons, base, k);
    if (!top) return std::nullopt;
    result.push_back(*top);
  }
  // The lid goes the other way round.
  std::vector<Id> lid(result.rbegin(), result.rbegin() + static_cast<std::ptrdiff_t>(n));
  const std::vector<Id> wanted = roundTrip(lid);
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    if (i == base || polygons[i].size() != n || roundTrip(polygons[i]) != wanted) continue;
    // VTK's wedge has its first triangle outward, the other prisms have their first polygon inward.
    if (n != 3) {
      std::reverse(result.begin() + 1, result.begin() + static_cast<std::ptrdiff_t>(n));
      std::reverse(result.begin() + static_cast<std::ptrdiff_t>(n) + 1, result.end());
    }
    return result;
  }
  return std::nullopt;
}

std::size_t firstOfSize(const Polygons& polygons, std::size_t size) {
  std::size_t i = 0;
  while (i < polygons.size() && polygons[i].size() != size)
    ++i;
  return i;
}

}  // namespace

std::optional<Recognised> recognise(const Polygons& polygons) {
  const std::vector<Id> vertices = distinctVertices(polygons);
  std::array<std::size_t, 7> of_size{};
  for (std::size_t i = 0; i < polygons.size(); ++i)
    ++of_size[std::min<std::size_t>(polygons[i].size(), 7) - 1];
  const std::size_t triangles = of_size[2], quads = of_size[3];
  const auto is = [&](std::size_t faces, std::size_t corners) {
    return polygons.size() == faces && vertices.size() == corners;
  };
  const auto answer = [](CellType type, std::optional<std::vector<Id>> found) -> std::optional<Recognised> {
    if (!found) return std::nullopt;
    return Recognised{type, std::move(*found)};
  };
  if (is(4, 4) && triangles == 4) return answer(CellType::tetrahedron, recogniseCone(polygons, 0, vertices));
  if (is(5, 5) && triangles == 4 && quads == 1) {
    return answer(CellType::pyramid, recogniseCone(polygons, firstOfSize(polygons, 4), vertices));
  }
  if (is(5, 6) && triangles == 2 && quads == 3) {
    return answer(CellType::wedge, recognisePrism(polygons, firstOfSize(polygons, 3)));
  }
  if (is(6, 8) && quads == 6) return answer(CellType::hexahedron, recognisePrism(polygons, 0));
  if (is(7, 10) && quads == 5 && of_size[4] == 2) {
    return answer(CellType::pentagonal_prism, recognisePrism(polygons, firstOfSize(polygons, 5)));
  }
  if (is(8, 12) && quads == 6 && of_size[5] == 2) {
    return answer(CellType::hexagonal_prism, recognisePrism(polygons, firstOfSize(polygons, 6)));
  }
  return std::nullopt;
}

}  // namespace spillikin::mesh
