// One interface for every visibility order: prepare once per geometry, ask once per viewpoint.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spillikin/base/view.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::sort {

enum class Algorithm : std::uint8_t {
  automatic,
  mpvo,
  mpvonc,
  xmpvo,
  bsp_xmpvo,
  power,
  newell,
  convexified,
  centroid,
  none,
};
// The names of the command line: "auto", "mpvo", "bsp-xmpvo", ...
const char* name(Algorithm algorithm);
Algorithm algorithm(std::string_view name);  // throws Error that lists the names

// A half-space: the side where dot(normal, p) + offset >= 0.
struct HalfSpace {
  Vec3 normal{0.0};
  double offset = 0.0;
};

// Where a cell of a cycle was cut: the entry's cell counts only inside all of its half-spaces.
struct Cut {
  std::uint32_t entry = 0;  // index into Order::cells
  std::span<const HalfSpace> keep;
};

// By ascending entry, the half-spaces of all in one pool. Reused, it stops allocating.
class Cuts {
 public:
  std::size_t size() const { return entry_.size(); }
  bool empty() const { return entry_.empty(); }
  Cut operator[](std::size_t i) const {
    return {entry_[i], {pool_.data() + (i == 0 ? 0 : end_[i - 1]), pool_.data() + end_[i]}};
  }
  // The first of this entry or a later one; size() if there is none.
  std::size_t first(std::size_t entry) const {
    return static_cast<std::size_t>(std::lower_bound(entry_.begin(), entry_.end(), entry) - entry_.begin());
  }
  std::size_t halfSpaces() const { return pool_.size(); }

  void clear() {
    entry_.clear();
    end_.clear();
    pool_.clear();
  }
  // For so many, and half-spaces of all of them together, without the slack of growing by doubling.
  void reserve(std::size_t cuts, std::size_t half_spaces) {
    entry_.reserve(cuts);
    end_.reserve(cuts);
    pool_.reserve(half_spaces);
  }
  // `entry` after those that there are.
  void add(std::uint32_t entry, std::span<const HalfSpace> keep) {
    open(entry);
    for (const HalfSpace& half : keep)
      put(half);
  }
  // The same, one half-space at a time.
  void open(std::uint32_t entry) {
    entry_.push_back(entry);
    end_.push_back(static_cast<std::uint32_t>(pool_.size()));
  }
  void put(const HalfSpace& half) {
    pool_.push_back(half);
    ++end_.back();
  }

 private:
  std::vector<std::uint32_t> entry_, end_;
  std::vector<HalfSpace> pool_;
};

// Quadrilaterals through which a ray leaves a cell and enters it again, and these cells (problem_faces.h). Not known
// where the algorithm looks at no face.
struct Problems {
  bool known = false;
  std::size_t faces = 0, cells = 0;
};

// A visibility order. Reused from view to view, it stops allocating.
struct Order {
  std::vector<mesh::Id> cells;  // back to front; every cell once, once per piece where it was cut
  std::vector<std::uint32_t>
      layer_offset;  // empty, or starts of runs of cells that do not obscure each other, and the end
  Cuts cuts;
  // Strongly connected cells that were found, before any cut of theirs. What one curved face does between two cells is
  // none: the problem cell is in parts from the start (parted_cells.h).
  std::vector<std::vector<mesh::Id>> cycles;
  Problems problems;
  bool exact = false;  // proven right for this mesh and viewpoint
};

// Prepared by makeSorter for one geometry; the mesh must outlive it unchanged. operator() may run on all cores and
// gives the same order whatever their number.
class Sorter {
 public:
  virtual ~Sorter() = default;
  virtual void operator()(const Viewpoint& viewpoint, Order& order) = 0;
  virtual Algorithm algorithm() const = 0;  // never automatic: what was chosen
  virtual std::string why() const = 0;      // one sentence: what makes this order exact or not on this mesh
  virtual bool exact() const = 0;           // right from every viewpoint on this mesh
  virtual std::size_t bytes() const = 0;    // kept by the sorter

  // What else there is to do may start once a view's work goes on on one core alone. Returns whether the sorter will
  // call `start` then, in every view, from the thread that asked for the order; empty: no longer.
  // NOLINTNEXTLINE(performance-unnecessary-value-param): those that heed it keep it
  virtual bool whileSerial(std::function<void()> /*start*/) { return false; }
};

// What makes this one order exact or not, in a sentence: the sorter's, unless cells of a cycle overlapped in this view.
std::string why(const Sorter& sorter, const Order& order);

// What becomes of a cell in a cycle because of its curved faces: it is cut by the plane of one of their triangles, or
// subdivided into the tetrahedra of the smallest-vertex rule (Max, Williams, Silva 2000, section V) before anything is
// cut. Both orders are right; cutting makes fewer pieces (see the README).
enum class CurvedCells : std::uint8_t { cut, tetrahedra };

struct Convexity;  // convexity.h

// Throws Error when the algorithm cannot work on the mesh. `curved` is heeded by mpvo and xmpvo. `convexity`: the
// mesh's, where it is known, so that automatic and mpvo need not find it again.
std::unique_ptr<Sorter> makeSorter(Algorithm algorithm, const mesh::Mesh& mesh, CurvedCells curved = CurvedCells::cut,
                                   const Convexity* convexity = nullptr);

}  // namespace spillikin::sort
