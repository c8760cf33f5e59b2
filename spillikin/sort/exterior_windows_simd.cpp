// Windows of points and triangles and the search among them, for every SIMD target (Highway, chosen at run time).
#include "spillikin/sort/exterior_windows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/sort/exterior_windows_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spillikin::sort {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::uint16_t most = 0xFFFF;
// Squares of lengths below this have lost digits: such a point is taken for one in the eye.
constexpr double least_square = 1e-280;
// Unit vectors that differ by L, L^2 = x: 1 / sqrt(1 - x / 3) - 1 <= 0.2063 x and 1 - sqrt(1 - x / 3) <= 0.1787 x up to
// x = 3/4, rounded up here for float.
constexpr float widest = 0.74F, rise = 0.207F, nearer = 0.18F;

// Numbers of at least zero, to 16 bits.
template <class D, class V>
auto words(D d, V v, double limit) {
  const auto within = hn::Min(hn::Max(v, hn::Zero(d)), hn::Set(d, limit));
  const hn::Rebind<std::int32_t, D> d32;
  const hn::Rebind<std::uint16_t, D> d16;
  return hn::DemoteTo(d16, hn::DemoteTo(d32, within));
}

void LookAtPoints(const double* x, const double* y, const double* z, std::size_t count, const WindowFrame& frame,
                  std::uint16_t* lower, std::uint16_t* upper) {
  const hn::CappedTag<double, WindowNode::wide> d;
  const hn::Rebind<std::uint16_t, decltype(d)> d16;
  const auto set = [&](double a) { return hn::Set(d, a); };
  const auto room = set(frame.room), scale = set(frame.scale), level_room = set(frame.level_room);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    auto u = hn::Sub(hn::LoadU(d, x + i), set(frame.origin.x)), v = hn::Sub(hn::LoadU(d, y + i), set(frame.origin.y));
    auto w = hn::Sub(hn::LoadU(d, z + i), set(frame.origin.z));
    auto distance = hn::Zero(d);
    auto known = hn::Eq(distance, distance);
    if (frame.parallel) {
      const auto sx = set(frame.sight.x), sy = set(frame.sight.y), sz = set(frame.sight.z);
      distance = hn::Neg(hn::MulAdd(u, sx, hn::MulAdd(v, sy, hn::Mul(w, sz))));
      u = hn::MulAdd(distance, sx, u);
      v = hn::MulAdd(distance, sy, v);
      w = hn::MulAdd(distance, sz, w);
    } else {
      const auto square = hn::MulAdd(u, u, hn::MulAdd(v, v, hn::Mul(w, w)));
      known = hn::Ge(square, set(least_square));
      distance = hn::Sqrt(square);
      const auto inverse = hn::Div(set(1.0), hn::IfThenElse(known, distance, set(1.0)));
      u = hn::Mul(u, inverse);
      v = hn::Mul(v, inverse);
      w = hn::Mul(w, inverse);
    }
    u = hn::Mul(hn::Sub(u, set(frame.low.x)), scale);
    v = hn::Mul(hn::Sub(v, set(frame.low.y)), scale);
    w = hn::Mul(hn::Sub(w, set(frame.low.z)), scale);
    const auto level = hn::Mul(hn::Sub(set(frame.farthest), distance), set(frame.level_scale));
    const auto from = [&](auto a) { return words(d, hn::IfThenElse(known, hn::Sub(a, room), hn::Zero(d)), most); };
    const auto to = [&](auto a) { return words(d, hn::IfThenElse(known, hn::Add(a, room), set(most)), most); };
    constexpr double last = ExteriorWindows::levels - 1;
    hn::StoreInterleaved4(from(u), from(v), from(w), words(d, hn::Sub(level, level_room), last), d16, lower + 4 * i);
    hn::StoreInterleaved4(to(u), to(v), to(w), words(d, hn::Add(level, level_room), last), d16, upper + 4 * i);
  }
}

#if HWY_TARGET == HWY_SCALAR

// One lane after the other: what the vectors of eight do elsewhere.
void widen(const WindowFrame& frame, WindowNode& node, std::size_t j, std::uint16_t& greatest) {
  if (frame.parallel) return;
  const auto step = static_cast<float>(1.0 / frame.scale);
  float sides = 0.0F;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto side = static_cast<float>(node.upper[k][j] - node.lower[k][j] + 1);
    sides += side * side * step;
  }
  const auto up = [&](float a) {
    return static_cast<int>(sides * step > widest ? float{most} : std::min(a + 1.0F, float{most}));
  };
  const int by = up(sides * rise);
  for (std::size_t k = 0; k < 3; ++k) {
    node.lower[k][j] = static_cast<std::uint16_t>(std::max(node.lower[k][j] - by, 0));
    node.upper[k][j] = static_cast<std::uint16_t>(std::min(node.upper[k][j] + by, int{most}));
  }
  const float height = static_cast<float>(frame.farthest * frame.level_scale) - static_cast<float>(greatest);
  const int closer = greatest + up(sides * step * nearer * std::max(height, 0.0F));
  greatest = static_cast<std::uint16_t>(std::min(closer, ExteriorWindows::levels - 1));
}

void LookAtTriangles(const std::array<std::uint32_t, 3>* corner, const std::uint16_t* lower, const std::uint16_t* upper,
                     const WindowFrame& frame, std::size_t count, WindowNode* nodes, std::uint16_t* least,
                     std::uint16_t* greatest) {
  for (std::size_t t = 0; t < count * WindowNode::wide; ++t) {
    const auto& [a, b, c] = corner[t];
    WindowNode& node = nodes[t / WindowNode::wide];
    const std::size_t j = t % WindowNode::wide;
    const auto from = [&](std::size_t k) { return std::min({lower[4 * a + k], lower[4 * b + k], lower[4 * c + k]}); };
    const auto to = [&](std::size_t k) { return std::max({upper[4 * a + k], upper[4 * b + k], upper[4 * c + k]}); };
    for (std::size_t k = 0; k < 3; ++k) {
      node.lower[k][j] = from(k);
      node.upper[k][j] = to(k);
    }
    least[t] = from(3);
    greatest[t] = to(3);
    widen(frame, node, j, greatest[t]);
  }
}

void UniteWindows(const WindowNode* children, std::size_t count, WindowNode& node) {
  for (std::size_t j = 0; j < count; ++j) {
    const WindowNode& child = children[j];
    node.earliest[j] = *std::min_element(child.earliest.begin(), child.earliest.end());
    node.latest[j] = *std::max_element(child.latest.begin(), child.latest.end());
    for (std::size_t k = 0; k < 3; ++k) {
      node.lower[k][j] = most;
      node.upper[k][j] = 0;
      for (std::size_t i = 0; i < WindowNode::wide; ++i) {
        if (child.earliest[i] == ExteriorWindows::never) continue;
        node.lower[k][j] = std::min(node.lower[k][j], child.lower[k][i]);
        node.upper[k][j] = std::max(node.upper[k][j], child.upper[k][i]);
      }
    }
  }
}

struct Query {
  std::array<std::uint16_t, 3> lower{most, most, most}, upper{};
  Turn first = most, last = 0;

  void add(const WindowNode& of, const WindowQuery& query) {
    for (std::size_t k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], of.lower[k][query.triangle % WindowNode::wide]);
      upper[k] = std::max(upper[k], of.upper[k][query.triangle % WindowNode::wide]);
    }
    first = std::min(first, query.first);
    last = std::max(last, query.last);
  }

  unsigned meeting(const WindowNode& node) const {
    unsigned bits = 0;
    for (std::size_t j = 0; j < WindowNode::wide; ++j) {
      bool meets = node.earliest[j] <= last && node.latest[j] >= first;
      for (std::size_t k = 0; k < 3; ++k)
        meets = meets && node.lower[k][j] <= upper[k] && node.upper[k][j] >= lower[k];
      bits |= (meets ? 1U : 0U) << j;
    }
    return bits;
  }
};

#else

using Words = hn::FixedTag<std::uint16_t, WindowNode::wide>;

template <class V>
struct Four {
  V x, y, z, level;
};
using Window = Four<hn::Vec<Words> >;

// The sum of the squares of a window's sides, which rounding made shorter by less than one, for one half of its lanes.
template <class D, class W>
auto square(D d, const W& lower, const W& upper, bool high) {
  const auto side = [&](auto a, auto b) {
    const auto difference = hn::SaturatedAdd(hn::Sub(b, a), hn::Set(Words(), std::uint16_t{1}));
    const hn::Half<Words> half;
    const auto lanes = high ? hn::UpperHalf(half, difference) : hn::LowerHalf(half, difference);
    return hn::ConvertTo(d, hn::PromoteTo(hn::Rebind<std::int32_t, D>(), lanes));
  };
  const auto x = side(lower.x, upper.x), y = side(lower.y, upper.y), z = side(lower.z, upper.z);
  return hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
}

// What a triangle on the sphere reaches beyond the box of its corners, and how much nearer than they its plane comes.
void widen(const WindowFrame& frame, Window& lower, Window& upper) {
  if (frame.parallel) return;
  const Words words;
  const hn::FixedTag<float, WindowNode::wide / 2> d;
  const hn::Rebind<std::int32_t, decltype(d)> d32;
  const hn::Half<Words> half;
  const auto step = static_cast<float>(1.0 / frame.scale);
  const auto far = hn::Set(d, static_cast<float>(frame.farthest * frame.level_scale));
  hn::Vec<decltype(half)> beyond[2], closer[2];
  for (const bool high : {false, true}) {
    const auto sides = hn::Mul(square(d, lower, upper, high), hn::Set(d, step));  // L^2 / step
    const auto wide = hn::Gt(hn::Mul(sides, hn::Set(d, step)), hn::Set(d, widest));
    const auto full = hn::Set(d, static_cast<float>(most));
    const auto up = [&](auto a) {
      const auto all = hn::IfThenElse(wide, full, hn::Min(hn::Add(a, hn::Set(d, 1.0F)), full));
      return hn::DemoteTo(half, hn::ConvertTo(d32, all));
    };
    const auto levels = high ? hn::UpperHalf(half, upper.level) : hn::LowerHalf(half, upper.level);
    const auto height = hn::Sub(far, hn::ConvertTo(d, hn::PromoteTo(d32, levels)));
    beyond[high ? 1 : 0] = up(hn::Mul(sides, hn::Set(d, rise)));
    closer[high ? 1 : 0] = up(hn::Mul(hn::Mul(sides, hn::Set(d, step * nearer)), hn::Max(height, hn::Zero(d))));
  }
  const auto by = hn::Combine(words, beyond[1], beyond[0]);
  lower.x = hn::SaturatedSub(lower.x, by);
  lower.y = hn::SaturatedSub(lower.y, by);
  lower.z = hn::SaturatedSub(lower.z, by);
  upper.x = hn::SaturatedAdd(upper.x, by);
  upper.y = hn::SaturatedAdd(upper.y, by);
  upper.z = hn::SaturatedAdd(upper.z, by);
  const auto last = hn::Set(words, static_cast<std::uint16_t>(ExteriorWindows::levels - 1));
  upper.level = hn::Min(hn::SaturatedAdd(upper.level, hn::Combine(words, closer[1], closer[0])), last);
}

void LookAtTriangles(const std::array<std::uint32_t, 3>* corner, const std::uint16_t* lower, const std::uint16_t* upper,
                     const WindowFrame& frame, std::size_t count, WindowNode* nodes, std::uint16_t* least,
                     std::uint16_t* greatest) {
  const Words words;
  const hn::FixedTag<std::uint16_t, 4> d;
  HWY_ALIGN std::uint16_t low[4 * WindowNode::wide], high[4 * WindowNode::wide];
  for (std::size_t n = 0; n < count; ++n) {
    for (std::size_t j = 0; j < WindowNode::wide; ++j) {
      const auto& [a, b, c] = corner[WindowNode::wide * n + j];
      const auto at = [&](const std::uint16_t* of, std::uint32_t i) { return hn::LoadU(d, of + std::size_t{4} * i); };
      hn::StoreU(hn::Min(hn::Min(at(lower, a), at(lower, b)), at(lower, c)), d, low + 4 * j);
      hn::StoreU(hn::Max(hn::Max(at(upper, a), at(upper, b)), at(upper, c)), d, high + 4 * j);
    }
    Window from, to;
    hn::LoadInterleaved4(words, low, from.x, from.y, from.z, from.level);
    hn::LoadInterleaved4(words, high, to.x, to.y, to.z, to.level);
    widen(frame, from, to);
    WindowNode& node = nodes[n];
    hn::StoreU(from.x, words, node.lower[0].data());
    hn::StoreU(from.y, words, node.lower[1].data());
    hn::StoreU(from.z, words, node.lower[2].data());
    hn::StoreU(to.x, words, node.upper[0].data());
    hn::StoreU(to.y, words, node.upper[1].data());
    hn::StoreU(to.z, words, node.upper[2].data());
    hn::StoreU(from.level, words, least + WindowNode::wide * n);
    hn::StoreU(to.level, words, greatest + WindowNode::wide * n);
  }
}

void UniteWindows(const WindowNode* children, std::size_t count, WindowNode& node) {
  const Words d;
  const auto all = hn::Set(d, most), none = hn::Zero(d);
  for (std::size_t j = 0; j < count; ++j) {
    const WindowNode& child = children[j];
    const auto earliest = hn::LoadU(d, child.earliest.data());
    const auto empty = hn::Eq(earliest, all);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto lower = hn::LoadU(d, child.lower[k].data()), upper = hn::LoadU(d, child.upper[k].data());
      node.lower[k][j] = hn::GetLane(hn::MinOfLanes(d, hn::IfThenElse(empty, all, lower)));
      node.upper[k][j] = hn::GetLane(hn::MaxOfLanes(d, hn::IfThenElse(empty, none, upper)));
    }
    node.earliest[j] = hn::GetLane(hn::MinOfLanes(d, earliest));
    node.latest[j] = hn::GetLane(hn::MaxOfLanes(d, hn::LoadU(d, child.latest.data())));
  }
}

struct Query {
  hn::Vec<Words> lower[3], upper[3], first, last;

  Query() : first(hn::Set(Words(), most)), last(hn::Zero(Words())) {
    for (std::size_t k = 0; k < 3; ++k) {
      lower[k] = first;
      upper[k] = last;
    }
  }
  void add(const WindowNode& of, const WindowQuery& query) {
    const Words d;
    for (std::size_t k = 0; k < 3; ++k) {
      lower[k] = hn::Min(lower[k], hn::Set(d, of.lower[k][query.triangle % WindowNode::wide]));
      upper[k] = hn::Max(upper[k], hn::Set(d, of.upper[k][query.triangle % WindowNode::wide]));
    }
    first = hn::Min(first, hn::Set(d, query.first));
    last = hn::Max(last, hn::Set(d, query.last));
  }

  // Bit j: lane j of the node meets the window and is in time.
  unsigned meeting(const WindowNode& node) const {
    const Words d;
    // Where a is at most b, the saturated a - b is zero.
    auto over = hn::Or(hn::SaturatedSub(hn::LoadU(d, node.earliest.data()), last),
                       hn::SaturatedSub(first, hn::LoadU(d, node.latest.data())));
    for (std::size_t k = 0; k < 3; ++k) {
      over = hn::Or(over, hn::SaturatedSub(hn::LoadU(d, node.lower[k].data()), upper[k]));
      over = hn::Or(over, hn::SaturatedSub(lower[k], hn::LoadU(d, node.upper[k].data())));
    }
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, hn::Eq(over, hn::Zero(d)), bytes);
    return bytes[0];
  }
};

#endif

void SearchWindows(const WindowNode* nodes, const TreeLevel* levels, std::size_t level_count,
                   const std::uint8_t* facing, std::span<const WindowQuery> queries, std::vector<WindowPair>& out) {
  if (level_count == 0) return;
  const WindowNode& of = nodes[queries.front().triangle / WindowNode::wide];
  Query all, each[WindowNode::wide];
  for (std::size_t i = 0; i < queries.size(); ++i) {
    all.add(of, queries[i]);
    each[i].add(of, queries[i]);
  }
  struct Entry {
    std::uint32_t level, node;
  };
  constexpr std::size_t deepest = 12;  // levels of eight: far more than 2^32 triangles
  Entry stack[deepest * WindowNode::wide];
  std::size_t depth = 0;
  stack[depth++] = {static_cast<std::uint32_t>(level_count - 1), 0};
  const auto forEach = [](unsigned bits, std::uint32_t node, auto&& f) {
    for (; bits != 0; bits &= bits - 1)
      f(static_cast<std::uint32_t>(WindowNode::wide) * node + static_cast<std::uint32_t>(__builtin_ctz(bits)));
  };
  while (depth > 0) {
    const Entry entry = stack[--depth];
    const std::size_t at = levels[entry.level].first + entry.node;
    const WindowNode& node = nodes[at];
    if (entry.level > 0) {
      const unsigned wanted = facing == nullptr ? 0xFFU : facing[at - levels[1].first];
      forEach(all.meeting(node) & wanted, entry.node, [&](std::uint32_t box) {
        stack[depth++] = {entry.level - 1, box};
      });
      continue;
    }
    for (std::size_t i = 0; i < queries.size(); ++i) {
      forEach(each[i].meeting(node), entry.node, [&](std::uint32_t found) {
        out.push_back({found, queries[i].triangle});
      });
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::sort
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::sort {
HWY_EXPORT(LookAtPoints);
HWY_EXPORT(LookAtTriangles);
HWY_EXPORT(UniteWindows);
HWY_EXPORT(SearchWindows);

void lookAtPoints(const double* x, const double* y, const double* z, std::size_t count, const WindowFrame& frame,
                  std::uint16_t* lower, std::uint16_t* upper) {
  HWY_DYNAMIC_DISPATCH(LookAtPoints)(x, y, z, count, frame, lower, upper);
}
void lookAtTriangles(const std::array<std::uint32_t, 3>* corner, const std::uint16_t* lower, const std::uint16_t* upper,
                     const WindowFrame& frame, std::size_t count, WindowNode* nodes, std::uint16_t* least,
                     std::uint16_t* greatest) {
  HWY_DYNAMIC_DISPATCH(LookAtTriangles)(corner, lower, upper, frame, count, nodes, least, greatest);
}
void uniteWindows(const WindowNode* children, std::size_t count, WindowNode& node) {
  HWY_DYNAMIC_DISPATCH(UniteWindows)(children, count, node);
}
void searchWindows(const WindowNode* nodes, const TreeLevel* levels, std::size_t level_count,
                   const std::uint8_t* facing, std::span<const WindowQuery> queries, std::vector<WindowPair>& out) {
  HWY_DYNAMIC_DISPATCH(SearchWindows)(nodes, levels, level_count, facing, queries, out);
}
}  // namespace spillikin::sort
#endif
