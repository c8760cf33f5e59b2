// The search in the tree of boxes, for every SIMD target (Highway, chosen at run time).
#include "spillikin/sort/exterior_tree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spillikin/sort/exterior_tree_simd.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spillikin::sort {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Which boxes of a node reach into all four half-spaces: centre's height plus the reach of the half extents.
template <class D>
unsigned reach(D d, const TreeNode& node, const TreePlane planes[4]) {
  unsigned bits = 0;
  for (std::size_t k = 0; k < TreeNode::wide; k += hn::Lanes(d)) {
    const auto cx = hn::LoadU(d, node.cx.data() + k), cy = hn::LoadU(d, node.cy.data() + k);
    const auto cz = hn::LoadU(d, node.cz.data() + k), hx = hn::LoadU(d, node.hx.data() + k);
    const auto hy = hn::LoadU(d, node.hy.data() + k), hz = hn::LoadU(d, node.hz.data() + k);
    auto least = hn::Set(d, 1.0F);
    for (std::size_t q = 0; q < 4; ++q) {
      const auto x = hn::Set(d, planes[q].x), y = hn::Set(d, planes[q].y), z = hn::Set(d, planes[q].z);
      auto s = hn::MulAdd(x, cx, hn::Set(d, planes[q].w));
      s = hn::MulAdd(y, cy, s);
      s = hn::MulAdd(z, cz, s);
      s = hn::MulAdd(hn::Abs(x), hx, s);
      s = hn::MulAdd(hn::Abs(y), hy, s);
      s = hn::MulAdd(hn::Abs(z), hz, s);
      least = hn::Min(least, s);
    }
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, hn::Ge(least, hn::Zero(d)), bytes);
    bits |= static_cast<unsigned>(bytes[0]) << k;
  }
  return bits;
}

// Which boxes of a node hold a turn of at most `last` and a guess of at least `first`.
unsigned inTime(const TreeTurns& turns, Turn first, Turn last) {
  const hn::CappedTag<Turn, TreeNode::wide> d;
  unsigned bits = 0;
  for (std::size_t k = 0; k < TreeNode::wide; k += hn::Lanes(d)) {
    std::uint8_t bytes[8] = {};
    const auto earliest = hn::LoadU(d, turns.earliest.data() + k), latest = hn::LoadU(d, turns.latest.data() + k);
    const auto not_late = hn::Eq(hn::Min(earliest, hn::Set(d, last)), earliest);
    hn::StoreMaskBits(d, hn::And(not_late, hn::Eq(hn::Max(latest, hn::Set(d, first)), latest)), bytes);
    bits |= static_cast<unsigned>(bytes[0]) << k;
  }
  return bits;
}

void SearchTree(const TreeNode* nodes, const TreeTurns* turns, const TreeLevel* levels, std::size_t level_count,
                const TreePlane* planes, Turn first, Turn last, std::vector<std::uint32_t>& out) {
  if (level_count == 0) return;
  const hn::CappedTag<float, TreeNode::wide> d;
  struct Entry {
    std::uint32_t level, node;
  };
  constexpr std::size_t deepest = 12;  // levels of eight: far more than 2^32 triangles
  Entry stack[deepest * TreeNode::wide];
  std::size_t depth = 0;
  stack[depth++] = {static_cast<std::uint32_t>(level_count - 1), 0};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    const std::size_t at = levels[entry.level].first + entry.node;
    const unsigned wanted = inTime(turns[at], first, last);
    for (unsigned bits = wanted == 0 ? 0 : reach(d, nodes[at], planes) & wanted; bits != 0; bits &= bits - 1) {
      const auto box =
          static_cast<std::uint32_t>(TreeNode::wide) * entry.node + static_cast<std::uint32_t>(__builtin_ctz(bits));
      if (entry.level == 0) {
        out.push_back(box);
      } else {
        stack[depth++] = {entry.level - 1, box};
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::sort
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::sort {
HWY_EXPORT(SearchTree);

void searchTree(const TreeNode* nodes, const TreeTurns* turns, const TreeLevel* levels, std::size_t level_count,
                const TreePlane planes[4], Turn first, Turn last, std::vector<std::uint32_t>& out) {
  HWY_DYNAMIC_DISPATCH(SearchTree)(nodes, turns, levels, level_count, planes, first, last, out);
}
}  // namespace spillikin::sort
#endif
