#include "tests/support/meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <initializer_list>
#include <map>
#include <random>
#include <set>
#include <stdexcept>

#include "tests/support/value.h"

namespace spillikin::tests {

namespace {

using Id = std::uint32_t;
using Hexahedron = std::array<Id, 8>;  // VTK's order

// VTK's hexahedron: the faces, outward.
constexpr int hexahedron_faces[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                        {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};

void addCell(mesh::Source& source, std::uint8_t type, const Id* ids, std::size_t count) {
  if (source.offsets.empty()) {
    source.offsets.push_back(0);
  }
  source.connectivity.insert(source.connectivity.end(), ids, ids + count);
  source.offsets.push_back(source.connectivity.size());
  source.types.push_back(type);
}

// Cones the faces that do not touch the smallest vertex, each cut from its own smallest vertex: always six, in line
// with every neighbour that is cut in the same way. Written apart from mesh/subdivide, which it helps to test.
void addTetrahedra(mesh::Source& source, const Hexahedron& hexahedron) {
  const Id apex = *std::min_element(hexahedron.begin(), hexahedron.end());
  for (const auto& face : hexahedron_faces) {
    std::array<Id, 4> quad{};
    for (std::size_t k = 0; k < 4; ++k) {
      quad[k] = hexahedron[static_cast<std::size_t>(face[k])];
    }
    if (std::find(quad.begin(), quad.end(), apex) != quad.end()) {
      continue;
    }
    std::rotate(quad.begin(), std::min_element(quad.begin(), quad.end()), quad.end());
    const std::array<Id, 4> first{quad[0], quad[2], quad[1], apex};
    const std::array<Id, 4> second{quad[0], quad[3], quad[2], apex};
    addCell(source, mesh::vtk_cell::tetra, first.data(), 4);
    addCell(source, mesh::vtk_cell::tetra, second.data(), 4);
  }
}

void addGridPoints(mesh::Source& source, std::size_t n, double jitter, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-jitter, jitter);
  const auto inner = [n](std::size_t i) { return i > 0 && i < n; };
  source.points.reserve((n + 1) * (n + 1) * (n + 1));
  for (std::size_t k = 0; k <= n; ++k) {
    for (std::size_t j = 0; j <= n; ++j) {
      for (std::size_t i = 0; i <= n; ++i) {
        Vec3 p(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
        if (jitter > 0.0 && inner(i) && inner(j) && inner(k)) {
          p.x += uniform(random);
          p.y += uniform(random);
          p.z += uniform(random);
        }
        source.points.push_back(p);
      }
    }
  }
}

template <typename Add>
mesh::Source grid(std::size_t n, double jitter, std::uint64_t seed, const Add& add) {
  mesh::Source source;
  addGridPoints(source, n, jitter, seed);
  const auto id = [n](std::size_t i, std::size_t j, std::size_t k) {
    return static_cast<Id>((k * (n + 1) + j) * (n + 1) + i);
  };
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = 0; i < n; ++i) {
        add(source, Hexahedron{id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k), id(i, j, k + 1),
                               id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1), id(i, j + 1, k + 1)});
      }
    }
  }
  const double scale = 1.0 / static_cast<double>(n);
  addPointArray(source, "value", [scale](const Vec3& p) { return smoothValue(scale * p); });
  return source;
}

// Points by a key of whole numbers, made when first asked for.
class PointTable {
 public:
  template <typename Make>
  Id operator()(mesh::Source& source, const std::array<std::size_t, 4>& key, const Make& make) {
    const auto [entry, fresh] = ids_.try_emplace(key, static_cast<Id>(source.points.size()));
    if (fresh) {
      source.points.push_back(make());
    }
    return entry->second;
  }

 private:
  std::map<std::array<std::size_t, 4>, Id> ids_;
};

// A thick ring of square, slightly swollen cross-section around `centre`, in the plane of the unit vectors u and v.
void addTorus(mesh::Source& source, std::size_t n, const Vec3& centre, const Vec3& u, const Vec3& v) {
  constexpr double tube = 0.3;  // half width; two linked rings of radius 1 stay 1 apart
  const std::size_t around = 8 * n;
  const Vec3 axis = glm::cross(u, v);
  const Id first = static_cast<Id>(source.points.size());
  const auto coordinate = [n](std::size_t i) { return 2.0 * static_cast<double>(i) / static_cast<double>(n) - 1.0; };
  for (std::size_t a = 0; a < around; ++a) {
    const double angle = 2.0 * std::acos(-1.0) * static_cast<double>(a) / static_cast<double>(around);
    const Vec3 outward = std::cos(angle) * u + std::sin(angle) * v;
    for (std::size_t j = 0; j <= n; ++j) {
      for (std::size_t i = 0; i <= n; ++i) {
        const double x = coordinate(i);
        const double y = coordinate(j);
        source.points.push_back(centre + (1.0 + tube * x * (1.0 - 0.2 * y * y)) * outward +
                                tube * y * (1.0 - 0.2 * x * x) * axis);
      }
    }
  }
  const auto id = [&](std::size_t a, std::size_t j, std::size_t i) {
    return first + static_cast<Id>(((a % around) * (n + 1) + j) * (n + 1) + i);
  };
  for (std::size_t a = 0; a < around; ++a) {
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = 0; i < n; ++i) {
        addTetrahedra(source, {id(a, j, i), id(a, j, i + 1), id(a, j + 1, i + 1), id(a, j + 1, i), id(a + 1, j, i),
                               id(a + 1, j, i + 1), id(a + 1, j + 1, i + 1), id(a + 1, j + 1, i)});
      }
    }
  }
}

// The face stream of the convex hull of points, coplanar ones as one polygon. Brute force, for a handful of points.
std::vector<Id> hullFaceStream(const std::vector<Vec3>& points) {
  double size = 0.0;
  for (const Vec3& p : points) {
    size = std::max(size, glm::distance(p, points[0]));
  }
  const double flat = 1e-12 * size;  // world units: what counts as in the plane of three others
  std::set<std::vector<Id>> seen;
  std::vector<Id> stream{0};
  const Id count = static_cast<Id>(points.size());
  for (Id a = 0; a < count; ++a) {
    for (Id b = 0; b < count; ++b) {
      for (Id c = a + 1; c < count; ++c) {
        const Vec3 normal = glm::cross(points[b] - points[a], points[c] - points[a]);
        if (a >= b || b == c || glm::length(normal) <= flat * size) {
          continue;
        }
        const Vec3 unit = glm::normalize(normal);
        std::vector<Id> face;
        bool above = false;
        bool below = false;
        for (Id p = 0; p < count; ++p) {
          const double height = glm::dot(points[p] - points[a], unit);
          above = above || height > flat;
          below = below || height < -flat;
          if (std::fabs(height) <= flat) {
            face.push_back(p);
          }
        }
        if ((above && below) || !seen.insert(face).second) {
          continue;
        }
        Vec3 middle(0.0);
        for (const Id p : face) {
          middle += points[p] / static_cast<double>(face.size());
        }
        const Vec3 x = points[face[0]] - middle;
        const Vec3 y = glm::cross(above ? -unit : unit, x);
        std::sort(face.begin(), face.end(), [&](Id p, Id q) {
          const Vec3 dp = points[p] - middle;
          const Vec3 dq = points[q] - middle;
          return std::atan2(glm::dot(dp, y), glm::dot(dp, x)) < std::atan2(glm::dot(dq, y), glm::dot(dq, x));
        });
        ++stream[0];
        stream.push_back(static_cast<Id>(face.size()));
        stream.insert(stream.end(), face.begin(), face.end());
      }
    }
  }
  return stream;
}

Vec3 meanPoint(const mesh::Source& source, std::size_t cell) {
  std::vector<Id> ids(source.connectivity.begin() + static_cast<std::ptrdiff_t>(source.offsets[cell]),
                      source.connectivity.begin() + static_cast<std::ptrdiff_t>(source.offsets[cell + 1]));
  if (source.types[cell] == mesh::vtk_cell::polyhedron) {
    std::set<Id> used;
    for (std::size_t at = 1; at < ids.size(); at += ids[at] + 1) {
      used.insert(ids.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                  ids.begin() + static_cast<std::ptrdiff_t>(at + 1 + ids[at]));
    }
    ids.assign(used.begin(), used.end());
  }
  Vec3 sum(0.0);
  for (const Id id : ids) {
    sum += source.points[id];
  }
  return sum / static_cast<double>(ids.size());
}

}  // namespace

mesh::Source hexahedronGrid(std::size_t n, double jitter, std::uint64_t seed) {
  mesh::Source source = grid(n, jitter, seed, [](mesh::Source& to, const Hexahedron& hexahedron) {
    addCell(to, mesh::vtk_cell::hexahedron, hexahedron.data(), hexahedron.size());
  });
  source.name = "hexahedron grid";
  return source;
}

mesh::Source tetrahedronGrid(std::size_t n, double jitter, std::uint64_t seed) {
  mesh::Source source = grid(n, jitter, seed, addTetrahedra);
  source.name = "tetrahedron grid";
  return source;
}

mesh::Source mixedGrid(std::size_t n, double jitter, std::uint64_t seed) {
  mesh::Source source = grid(n, jitter, seed, [n](mesh::Source& to, const Hexahedron& v) {
    const std::size_t i = v[0] % (n + 1), j = v[0] / (n + 1) % (n + 1), kind = (i + j) % 3;
    const auto add = [&to](std::uint8_t type, std::initializer_list<Id> ids) {
      addCell(to, type, ids.begin(), ids.size());
    };
    if (kind == 0) addCell(to, mesh::vtk_cell::hexahedron, v.data(), v.size());
    if (kind == 1) {
      add(mesh::vtk_cell::wedge, {v[0], v[1], v[2], v[4], v[5], v[6]});
      add(mesh::vtk_cell::wedge, {v[0], v[2], v[3], v[4], v[6], v[7]});
    }
    if (kind == 2) {
      const auto apex = static_cast<Id>(to.points.size());
      Vec3 middle(0.0);
      for (const Id id : v)
        middle += 0.125 * to.points[id];
      to.points.push_back(middle);
      for (const auto& f : hexahedron_faces)
        add(mesh::vtk_cell::pyramid, {v[f[3]], v[f[2]], v[f[1]], v[f[0]], apex});
    }
  });
  source.name = "mixed grid";
  return source;
}

mesh::Source oneCell(std::uint8_t type, const std::vector<Vec3>& points) {
  mesh::Source source;
  source.name = "one cell";
  source.points = points;
  std::vector<Id> ids;
  if (type == mesh::vtk_cell::polyhedron) {
    ids = hullFaceStream(points);
  } else {
    for (Id i = 0; i < static_cast<Id>(points.size()); ++i) {
      ids.push_back(i);
    }
  }
  addCell(source, type, ids.data(), ids.size());
  addPointArray(source, "value", smoothValue);
  return source;
}

mesh::Source shell(std::size_t n) {
  mesh::Source source;
  source.name = "shell";
  constexpr double inner = 0.6;
  constexpr double opening = 0.75;  // quadrilaterals of the sphere whose middle lies higher are left out
  const std::size_t layers = std::max<std::size_t>(1, n / 4);
  PointTable table;
  // Points of a cube's surface, i, j, k from 0 to n, pushed out to the spheres.
  const auto direction = [n](const std::array<std::size_t, 3>& p) {
    const double half = static_cast<double>(n) / 2.0;
    const double quarter_turn = std::acos(-1.0) / 4.0;
    Vec3 d;
    for (int axis = 0; axis < 3; ++axis) {
      d[axis] = std::tan(quarter_turn * (static_cast<double>(p[static_cast<std::size_t>(axis)]) / half - 1.0));
    }
    return glm::normalize(d);
  };
  const auto id = [&](const std::array<std::size_t, 3>& p, std::size_t layer) {
    return table(source, {p[0], p[1], p[2], layer}, [&] {
      return (inner + (1.0 - inner) * static_cast<double>(layer) / static_cast<double>(layers)) * direction(p);
    });
  };
  for (std::size_t side = 0; side < 6; ++side) {
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = 0; i < n; ++i) {
        std::array<std::array<std::size_t, 3>, 4> quad{};
        const std::size_t steps[4][2] = {{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}};
        double height = 0.0;
        for (std::size_t k = 0; k < 4; ++k) {
          quad[k][side / 2] = side % 2 == 0 ? 0 : n;
          quad[k][(side / 2 + 1) % 3] = steps[k][side % 2 == 0 ? 1 : 0];
          quad[k][(side / 2 + 2) % 3] = steps[k][side % 2 == 0 ? 0 : 1];
          height += 0.25 * direction(quad[k]).z;
        }
        for (std::size_t layer = 0; layer < layers && height < opening; ++layer) {
          Hexahedron hexahedron{};
          for (std::size_t k = 0; k < 4; ++k) {
            hexahedron[k] = id(quad[k], layer);
            hexahedron[k + 4] = id(quad[k], layer + 1);
          }
          addTetrahedra(source, hexahedron);
        }
      }
    }
  }
  addPointArray(source, "value", smoothValue);
  return source;
}

mesh::Source interlockedTori(std::size_t n) {
  mesh::Source source;
  source.name = "interlocked tori";
  addTorus(source, n, Vec3(0.0), Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0));
  addTorus(source, n, Vec3(1.0, 0.0, 0.0), Vec3(1.0, 0.0, 0.0), Vec3(0.0, 0.0, 1.0));
  addPointArray(source, "value", smoothValue);
  return source;
}

mesh::Source twistedRing(std::size_t cells, double twist) {
  mesh::Source source;
  source.name = "twisted ring";
  const double turn = 2.0 * std::acos(-1.0);
  for (std::size_t i = 0; i < cells; ++i) {
    const double at = turn * static_cast<double>(i) / static_cast<double>(cells);
    source.points.emplace_back(0.5 * std::cos(at), 0.5 * std::sin(at), 0.0);
    for (const double side : {-1.0, 1.0})
      source.points.emplace_back(std::cos(at + side * twist), std::sin(at + side * twist), 0.25 * side);
  }
  for (std::size_t i = 0; i < cells; ++i) {
    std::array<Id, 6> ids{};
    for (std::size_t k = 0; k < 6; ++k)
      ids[k] = static_cast<Id>(3 * ((i + k / 3) % cells) + k % 3);
    addCell(source, mesh::vtk_cell::wedge, ids.data(), ids.size());
  }
  addPointArray(source, "value", smoothValue);
  return source;
}

namespace {

// nx x ny x nz hexahedra on the unit cube's grid, each point moved to where `place` says.
mesh::Source mapped(std::size_t nx, std::size_t ny, std::size_t nz, const std::function<Vec3(const Vec3&)>& place) {
  mesh::Source source;
  for (std::size_t k = 0; k <= nz; ++k) {
    for (std::size_t j = 0; j <= ny; ++j) {
      for (std::size_t i = 0; i <= nx; ++i) {
        source.points.push_back(place(Vec3(static_cast<double>(i) / static_cast<double>(nx),
                                           static_cast<double>(j) / static_cast<double>(ny),
                                           static_cast<double>(k) / static_cast<double>(nz))));
      }
    }
  }
  const auto id = [&](std::size_t i, std::size_t j, std::size_t k) {
    return static_cast<Id>((k * (ny + 1) + j) * (nx + 1) + i);
  };
  for (std::size_t k = 0; k < nz; ++k) {
    for (std::size_t j = 0; j < ny; ++j) {
      for (std::size_t i = 0; i < nx; ++i) {
        const Hexahedron h{id(i, j, k),     id(i + 1, j, k),     id(i + 1, j + 1, k),     id(i, j + 1, k),
                           id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1), id(i, j + 1, k + 1)};
        addCell(source, mesh::vtk_cell::hexahedron, h.data(), h.size());
      }
    }
  }
  addPointArray(source, "value", smoothValue);
  return source;
}

}  // namespace

mesh::Source twistedBar(std::size_t n, double turn) {
  return mapped(n, n, 3 * n, [turn](const Vec3& p) {
    const double x = p.x - 0.5, y = p.y - 0.5, angle = turn * p.z;
    return Vec3(std::cos(angle) * x - std::sin(angle) * y, std::sin(angle) * x + std::cos(angle) * y, 3.0 * p.z);
  });
}

mesh::Source curvedBall(std::size_t n) {
  return mapped(n, n, n, [](const Vec3& p) {
    const Vec3 q = 2.0 * p - Vec3(1.0);
    const double reach = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)}), radius = glm::length(q);
    // Cubes in the middle, spheres outside, and what lies between in between.
    return radius > 0.0 ? q * ((1.0 - reach) / std::sqrt(3.0) + reach * reach / radius) : q;
  });
}

mesh::Source join(const mesh::Source& a, const mesh::Source& b) {
  mesh::Source joined = a;
  joined.name = a.name + " and " + b.name;
  joined.arrays.clear();
  joined.points.insert(joined.points.end(), b.points.begin(), b.points.end());
  const Id shift = static_cast<Id>(a.points.size());
  for (std::size_t cell = 0; cell < b.types.size(); ++cell) {
    std::vector<Id> ids(b.connectivity.begin() + static_cast<std::ptrdiff_t>(b.offsets[cell]),
                        b.connectivity.begin() + static_cast<std::ptrdiff_t>(b.offsets[cell + 1]));
    const bool stream = b.types[cell] == mesh::vtk_cell::polyhedron;
    std::size_t next_count = stream ? 1 : ids.size();  // where the stream's next number of points stands
    for (std::size_t k = stream ? 1 : 0; k < ids.size(); ++k) {
      if (k == next_count) {
        next_count += ids[k] + 1;
      } else {
        ids[k] += shift;
      }
    }
    addCell(joined, b.types[cell], ids.data(), ids.size());
  }
  if (!a.left_out.empty() || !b.left_out.empty()) {
    joined.left_out.resize(a.types.size(), 0);
    joined.left_out.insert(joined.left_out.end(), b.left_out.begin(), b.left_out.end());
    joined.left_out.resize(joined.types.size(), 0);
  }
  for (const mesh::Array& first : a.arrays) {
    for (const mesh::Array& second : b.arrays) {
      if (first.name == second.name && first.association == second.association &&
          first.components == second.components) {
        joined.arrays.push_back(first);
        joined.arrays.back().values.insert(joined.arrays.back().values.end(), second.values.begin(),
                                           second.values.end());
      }
    }
  }
  return joined;
}

void addPointArray(mesh::Source& source, const char* name, const std::function<double(const Vec3&)>& f) {
  mesh::Array array{name, mesh::Association::points, 1, {}};
  array.values.reserve(source.points.size());
  for (const Vec3& p : source.points) {
    array.values.push_back(f(p));
  }
  source.arrays.push_back(std::move(array));
}

void addCellArray(mesh::Source& source, const char* name, const std::function<double(const Vec3&)>& f) {
  mesh::Array array{name, mesh::Association::cells, 1, {}};
  array.values.reserve(source.types.size());
  for (std::size_t cell = 0; cell < source.types.size(); ++cell) {
    array.values.push_back(f(meanPoint(source, cell)));
  }
  source.arrays.push_back(std::move(array));
}

}  // namespace spillikin::tests
