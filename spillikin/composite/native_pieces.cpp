#include "spillikin/composite/native_pieces.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <span>

namespace spillikin::composite::native {

namespace {

constexpr std::size_t most_vertices = 8;  // of a cell that is looked at
constexpr std::size_t grain = 256;        // cuts

// A vertex this little outside of a half-space counts as inside, as a share of the largest of what the cell's heights
// are sums of and of these themselves: far more than their rounding, so that crossing points are known to a millionth
// of a cell.
constexpr double outside = 1e-9;
constexpr double margin = 0.01;  // pixels, for the rounding of crossing points and of planes in float

struct Extent {
  double x0 = std::numeric_limits<double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;
};

class PieceHull {
 public:
  PieceHull(const Screen& screen, std::span<const mesh::Id> vertices) : screen_(screen), vertices_(vertices) {}

  PixelBox box(std::span<const sort::HalfSpace> keep) {
    Extent all{0.0, 0.0, UINT16_MAX, UINT16_MAX};
    for (const sort::HalfSpace& half : keep) {
      Extent e;
      if (!measure(half) || !bound(e)) continue;
      all = {std::max(all.x0, e.x0), std::max(all.y0, e.y0), std::min(all.x1, e.x1), std::min(all.y1, e.y1)};
    }
    const auto first = [](double lo) { return pixel(std::ceil(lo - 0.5 - margin)); };
    const auto past = [](double hi) { return pixel(std::floor(hi - 0.5 + margin) + 1.0); };
    return {first(all.x0), first(all.y0), past(all.x1), past(all.y1)};
  }

 private:
  static std::uint16_t pixel(double at) { return static_cast<std::uint16_t>(std::clamp(at, 0.0, double{UINT16_MAX})); }

  // Heights of the vertices over the plane; false where the half-space keeps most of the cell.
  bool measure(const sort::HalfSpace& half) {
    const mesh::Mesh& mesh = screen_.mesh();
    double size = glm::dot(glm::abs(half.normal), glm::abs(mesh.points[vertices_.front()])) + std::abs(half.offset);
    for (std::size_t k = 0; k < vertices_.size(); ++k) {
      height_[k] = glm::dot(half.normal, mesh.points[vertices_[k]]) + half.offset;
      size = std::max(size, std::abs(height_[k]));
    }
    std::size_t kept = 0;
    for (std::size_t k = 0; k < vertices_.size(); ++k) {
      inside_[k] = height_[k] >= -outside * size;
      kept += inside_[k] ? 1 : 0;
    }
    return 2 * kept <= vertices_.size();
  }

  // The screen extent of what is inside; false where the eye plane may run through it.
  bool bound(Extent& e) const {
    bool before = true;
    const auto add = [&](double x, double y, double w) {
      if (!screen_.parallel()) {
        before = before && w > 0.0;
        x /= w;
        y /= w;
      }
      e = {std::min(e.x0, x), std::min(e.y0, y), std::max(e.x1, x), std::max(e.y1, y)};
    };
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
      if (!inside_[i]) continue;
      const Vertex& a = screen_.vertex(vertices_[i]);
      add(a.x, a.y, a.w);
      if (height_[i] <= 0.0) continue;
      for (std::size_t j = 0; j < vertices_.size(); ++j) {
        if (inside_[j]) continue;
        const Vertex& b = screen_.vertex(vertices_[j]);
        const double t = height_[i] / (height_[i] - height_[j]);
        add(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.w + t * (b.w - a.w));
      }
    }
    return before;
  }

  const Screen& screen_;
  std::span<const mesh::Id> vertices_;
  std::array<double, most_vertices> height_{};
  std::array<bool, most_vertices> inside_{};
};

}  // namespace

void findPieces(const Screen& screen, std::vector<PixelBox>& boxes) {
  const sort::Order& order = screen.frame().order;
  boxes.assign(order.cuts.size(), {});
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, boxes.size(), grain), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const sort::Cut cut = order.cuts[i];
      const auto vertices = screen.mesh().vertices(order.cells[cut.entry]);
      if (vertices.size() <= most_vertices) boxes[i] = PieceHull(screen, vertices).box(cut.keep);
    }
  });
}

}  // namespace spillikin::composite::native
