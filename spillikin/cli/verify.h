// The proof of an order: every pixel's ray against it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "spillikin/render/session.h"

namespace spillikin::cli {

// `back` is composited after (over) `front`, although `front` is nearer by `depth` world units. Cells by file id.
struct Inversion {
  int x = 0, y = 0;
  std::uint64_t front = 0, back = 0;
  double depth = 0.0;
};

struct Verification {
  std::size_t rays = 0, pairs = 0, inversions = 0;
  std::vector<Inversion> worst;  // at most 10, deepest first
  std::size_t overlaps = 0;      // pairs on a ray whose intervals overlap: no order is right there
  std::array<std::uint64_t, 2> first_overlap{};
};

// All pairs of cells on the ray of every pixel of the session's view, against the session's order.
Verification verify(render::Session& session, const std::function<void(double)>& progress);

}  // namespace spillikin::cli
