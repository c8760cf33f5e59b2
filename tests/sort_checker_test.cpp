// The checker against the definition, pair by pair.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "spillikin/sort/checker.h"

namespace spillikin::sort {
namespace {

const Vec3 origin(0.0), ahead(0.0, 0.0, 1.0);

TEST(OrderChecker, TellsInversionsFromOverlaps) {
  Order order;
  order.cells = {0, 1, 2};  // 0 is composited first, as the farthest
  const OrderChecker checker(order, 3);
  const auto tally = [&](std::vector<Crossing> crossings) {
    Tally t;
    checker.add(4, 5, origin, ahead, crossings, t);
    return t;
  };
  EXPECT_EQ(tally({{0, 2.0, 3.0}, {1, 1.0, 2.0}, {2, 0.5, 1.0}}).inversions, 0U);
  const Tally wrong = tally({{0, 1.0, 2.0}, {1, 2.0, 3.0}});
  EXPECT_EQ(wrong.inversions, 1U);
  EXPECT_EQ(wrong.contested, 0U);
  ASSERT_EQ(wrong.worst.size(), 1U);
  EXPECT_EQ(wrong.worst[0].front, 0U);
  EXPECT_EQ(wrong.worst[0].back, 1U);
  const Tally overlapping = tally({{0, 1.0, 2.5}, {1, 2.0, 3.0}});
  EXPECT_EQ(overlapping.inversions, 0U);
  EXPECT_EQ(overlapping.contested, 1U);
  EXPECT_EQ(overlapping.overlaps, 1U);
  EXPECT_TRUE(overlapping.worst.empty());
  const Tally right = tally({{1, 1.0, 2.5}, {0, 2.0, 3.0}});
  EXPECT_EQ(right.contested, 0U);
  EXPECT_EQ(right.overlaps, 1U);
}

TEST(OrderChecker, CountsEveryPair) {
  constexpr std::uint64_t seed = 19;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 10.0);
  for (int run = 0; run < 300; ++run) {
    const std::size_t count = 2 + random() % 12;
    Order order;
    order.cells.resize(count);
    std::iota(order.cells.begin(), order.cells.end(), 0U);
    std::shuffle(order.cells.begin(), order.cells.end(), random);
    std::vector<std::size_t> place(count);
    for (std::size_t i = 0; i < count; ++i)
      place[order.cells[i]] = i;
    std::vector<Crossing> crossings;
    const double longest = run % 3 == 0 ? 0.1 : 2.0;
    for (mesh::Id c = 0; c < count; ++c) {
      const double enter = u(random);
      crossings.push_back({c, enter, enter + 0.01 + longest * u(random) / 10.0});
    }
    std::size_t inversions = 0, contested = 0;
    for (const Crossing& a : crossings) {
      for (const Crossing& b : crossings) {
        if (a.enter >= b.enter || place[a.cell] > place[b.cell]) continue;
        ++(b.enter < a.leave - 1e-9 * std::max(b.enter, a.leave) ? contested : inversions);
      }
    }
    Tally tally;
    OrderChecker(order, count).add(0, 0, origin, ahead, crossings, tally);
    ASSERT_EQ(tally.inversions, inversions) << "seed " << seed << ", run " << run;
    ASSERT_EQ(tally.contested, contested) << "seed " << seed << ", run " << run;
    for (const Inversion& w : tally.worst) {
      EXPECT_LT(place[w.front], place[w.back]);
      EXPECT_LE(crossings[w.front].leave, crossings[w.back].enter + 1e-8);
    }
    EXPECT_EQ(tally.worst.empty(), inversions == 0);
  }
}

}  // namespace
}  // namespace spillikin::sort
