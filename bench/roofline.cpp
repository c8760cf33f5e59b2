#include "bench/roofline.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <vector>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/roofline.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spillikin::bench {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Twelve independent chains hide the latency of a multiply-add on every core so far (two units, four or five cycles).
// They start apart: of equal chains the compiler makes one. Returns the flops done; `sink` keeps it from dropping the
// work.
double MultiplyAdd(std::size_t steps, float* sink) {
  constexpr std::size_t chains = 12;
  const hn::ScalableTag<float> d;
  const auto start = [&](int k) HWY_ATTR { return hn::Iota(d, static_cast<float>(k) / 16.0F); };
  auto a0 = start(0), a1 = start(1), a2 = start(2), a3 = start(3), a4 = start(4), a5 = start(5);
  auto a6 = start(6), a7 = start(7), a8 = start(8), a9 = start(9), a10 = start(10), a11 = start(11);
  const auto m = hn::Set(d, 0.999F);
  const auto s = hn::Set(d, 0.001F);
  for (std::size_t i = 0; i < steps; ++i) {
    a0 = hn::MulAdd(a0, m, s);
    a1 = hn::MulAdd(a1, m, s);
    a2 = hn::MulAdd(a2, m, s);
    a3 = hn::MulAdd(a3, m, s);
    a4 = hn::MulAdd(a4, m, s);
    a5 = hn::MulAdd(a5, m, s);
    a6 = hn::MulAdd(a6, m, s);
    a7 = hn::MulAdd(a7, m, s);
    a8 = hn::MulAdd(a8, m, s);
    a9 = hn::MulAdd(a9, m, s);
    a10 = hn::MulAdd(a10, m, s);
    a11 = hn::MulAdd(a11, m, s);
  }
  const auto sum =
      hn::Add(hn::Add(hn::Add(hn::Add(a0, a1), hn::Add(a2, a3)), hn::Add(hn::Add(a4, a5), hn::Add(a6, a7))),
              hn::Add(hn::Add(a8, a9), hn::Add(a10, a11)));
  *sink = hn::GetLane(hn::SumOfLanes(d, sum));
  return 2.0 * static_cast<double>(chains * steps * hn::Lanes(d));
}

int LaneCount() {
  return static_cast<int>(hn::Lanes(hn::ScalableTag<float>()));
}

const char* TargetName() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace HWY_NAMESPACE
}  // namespace spillikin::bench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spillikin::bench {

HWY_EXPORT(MultiplyAdd);
HWY_EXPORT(LaneCount);
HWY_EXPORT(TargetName);

namespace {

constexpr int tries = 5;

template <class Work>
double secondsOf(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double flopsPerSecond(int threads) {
  constexpr std::size_t steps = 20'000'000;
  double best = 0.0;
  for (int t = 0; t < tries; ++t) {
    std::vector<double> flops(static_cast<std::size_t>(threads));
    std::vector<float> sink(static_cast<std::size_t>(threads) * 64);
    const auto one = [&](int i) {
      flops[static_cast<std::size_t>(i)] =
          HWY_DYNAMIC_DISPATCH(MultiplyAdd)(steps, &sink[static_cast<std::size_t>(i) * 64]);
    };
    const double seconds = secondsOf([&] { tbb::parallel_for(0, threads, one, tbb::static_partitioner()); });
    double sum = 0.0;
    for (const double f : flops)
      sum += f;
    best = std::max(best, sum / seconds);
  }
  return best;
}

double bytesPerSecond(int threads) {
  constexpr std::size_t count = std::size_t{24} << 20U;  // three arrays of 96 MB
  std::vector<float> a(count), b(count, 1.0F), c(count, 2.0F);
  double best = 0.0;
  tbb::task_arena arena(threads);
  for (int t = 0; t < tries; ++t) {
    const double seconds = secondsOf([&] {
      arena.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, count),
            [&](const tbb::blocked_range<std::size_t>& r) {
              const float s = 0.5F;
              for (std::size_t i = r.begin(); i < r.end(); ++i)
                a[i] = b[i] + s * c[i];
            },
            tbb::static_partitioner());
      });
    });
    best = std::max(best, 3.0 * sizeof(float) * static_cast<double>(count) / seconds);
  }
  return best;
}

}  // namespace

Roofline measureRoofline() {
  const int cores = tbb::info::default_concurrency();
  Roofline r;
  r.instructions = HWY_DYNAMIC_DISPATCH(TargetName)();
  r.lanes = HWY_DYNAMIC_DISPATCH(LaneCount)();
  r.flops = flopsPerSecond(1);
  r.all_flops = flopsPerSecond(cores);
  r.bytes = bytesPerSecond(1);
  r.all_bytes = bytesPerSecond(cores);
  return r;
}

}  // namespace spillikin::bench
#endif
