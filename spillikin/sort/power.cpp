#include "spillikin/sort/power.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/sort/weights.h"

namespace spillikin::sort {
namespace {

// Words before the first cell's key; the last of them is what exterior faces find beyond them.
constexpr std::size_t lead = 16;
constexpr std::uint32_t far_key = 1U << 24;
constexpr std::size_t faces_per_part = 1 << 15;

const mesh::Mesh& tetrahedra(const mesh::Mesh& mesh) {
  if (mesh.tetrahedral()) return mesh;
  throw Error(mesh.name + ": --sort power needs a mesh of tetrahedra alone; use --sort auto or --project tets");
}

std::string reason(const Convexity& convexity, const Regularity& r, bool weighted) {
  const char* what = weighted ? "regular with weights that were found" : "Delaunay";
  if (r.irregular > 0) {
    return fmt::format(
        "power distances order a regular triangulation, which this mesh is not known to be: {} of its "
        "interior faces are not locally Delaunay",
        r.irregular);
  }
  if (!r.ties_are_trees) {
    return fmt::format(
        "the mesh is locally Delaunay, but {} interior faces join tetrahedra of one circumsphere, all "
        "around edges",
        r.tied);
  }
  if (!convexity.convex) {
    return fmt::format(
        "the mesh is locally {}, but not convex ({}), and power distances prove nothing across empty "
        "space",
        what, convexity.why);
  }
  return fmt::format(
      "the mesh is convex and {} ({} interior faces locally regular, {} between tetrahedra of one circumsphere, none "
      "irregular), so that power distances order it; neighbours too near for rounding are decided exactly",
      what, r.regular, r.tied);
}

}  // namespace

struct PowerSort::Prepared {
  Convexity convexity;
  Regularity regularity;
  std::vector<double> heights;
};

PowerSort::Prepared PowerSort::prepare(const mesh::Mesh& mesh) {
  Prepared p{convexity(tetrahedra(mesh), exteriorTriangles(mesh)), regularity(mesh), {}};
  if (p.regularity.ordered() || !p.convexity.convex) return p;
  Weights weights = findWeights(mesh, false);
  if (weights.verdict != Weights::Verdict::exist) return p;
  p.heights = std::move(weights.heights);
  p.regularity = regularity(mesh, p.heights);
  return p;
}

PowerSort::PowerSort(const mesh::Mesh& mesh) : PowerSort(mesh, prepare(mesh)) {}

PowerSort::PowerSort(const mesh::Mesh& mesh, const Prepared& prepared)
    : PowerSort(mesh, prepared.convexity, prepared.regularity, prepared.heights) {}

PowerSort::PowerSort(const mesh::Mesh& mesh, const Convexity& convexity, const Regularity& regularity,
                     const std::vector<double>& heights)
    : mesh_(tetrahedra(mesh)),
      why_(reason(convexity, regularity, !heights.empty())),
      exact_(convexity.convex && regularity.ordered()),
      distance_(mesh, KeySort::keyBits(mesh.cell_count()), heights),
      keys_(lead + mesh.cell_count(), far_key),
      repair_(mesh) {}

void PowerSort::findSuspects(std::uint32_t certain) {
  static_assert(sizeof(mesh_.triangle_cells.front()) == 2 * sizeof(std::uint32_t));
  const auto* cells = reinterpret_cast<const std::uint32_t(*)[2]>(mesh_.triangle_cells.data());
  const std::size_t count = mesh_.triangle_count(), parts = (count + faces_per_part - 1) / faces_per_part;
  suspects_.resize(parts + 1);
  suspects_[parts] = distance_.hopelessFaces();
  tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
    suspects_[part].clear();
    closeFaces(cells, part * faces_per_part, std::min(count, (part + 1) * faces_per_part), keys_.data() + lead, certain,
               suspects_[part]);
  });
}

void PowerSort::operator()(const Viewpoint& viewpoint, Order& order) {
  const LiftedDistance::View view = distance_.view(viewpoint);
  std::uint32_t* keys = keys_.data() + lead;
  sort_(
      mesh_.cell_count(), [&](std::size_t begin, std::size_t end) { distance_.keys(view, begin, end, keys); }, keys,
      order.cells);
  order.layer_offset.clear();
  order.cuts.clear();
  order.cycles.clear();
  order.exact = order.cells.size() < 2;
  if (!exact_) return;
  findSuspects(view.certain);
  order.exact = repair_(suspects_, keys, sort_, viewpoint, order);
}

std::string PowerSort::why() const {
  return why_;
}

std::size_t PowerSort::suspectFaces() const {
  std::size_t sum = 0;
  for (const auto& part : suspects_)
    sum += part.size();
  return sum;
}

std::size_t PowerSort::bytes() const {
  std::size_t bytes = distance_.bytes() + keys_.capacity() * sizeof(std::uint32_t) + sort_.bytes();
  for (const auto& part : suspects_)
    bytes += part.capacity() * sizeof(mesh::Id);
  return bytes;
}

}  // namespace spillikin::sort
