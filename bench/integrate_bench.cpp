// Segments per second: the closed form in double, in float vectors, through whole transfer functions and tables.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

#include "spillikin/integrate/preintegrated.h"
#include "spillikin/integrate/psi_float.h"
#include "spillikin/integrate/segment.h"
#include "spillikin/integrate/segment_batch.h"

namespace {

using namespace spillikin::integrate;

constexpr std::size_t count = 4096;  // fits the first-level cache twice over; the arithmetic is what is timed

struct Segments {
  std::vector<float> x, y, front, back, length;
};

// Optical depths spread evenly in their logarithm between 10^lo and 10^hi.
Segments segments(double lo, double hi) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0), exponent(lo, hi);
  Segments s;
  for (std::size_t i = 0; i < count; ++i) {
    const double depth = std::pow(10.0, exponent(random));
    const double r = 2.0 * unit(random) - 1.0;
    s.x.push_back(static_cast<float>(depth * (1.0 - r)));
    s.y.push_back(static_cast<float>(depth * (1.0 + r)));
    s.front.push_back(static_cast<float>(unit(random)));
    s.back.push_back(static_cast<float>(unit(random)));
    s.length.push_back(static_cast<float>(depth));
  }
  return s;
}

void rate(benchmark::State& state) {
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(count));
}

Segments argument(const benchmark::State& state) {
  return segments(static_cast<double>(state.range(0)), static_cast<double>(state.range(1)));
}

void weightsDouble(benchmark::State& state) {
  const Segments s = argument(state);
  for (auto _ : state) {
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Weights w = weights(static_cast<double>(s.x[i]), static_cast<double>(s.y[i]));
      sum += w.front + w.back + w.alpha;
    }
    benchmark::DoNotOptimize(sum);
  }
  rate(state);
}

void weightsFloat(benchmark::State& state) {
  const Segments s = argument(state);
  for (auto _ : state) {
    float sum = 0.0F;
    for (std::size_t i = 0; i < count; ++i) {
      const auto w = psi::weights(s.x[i], s.y[i]);
      sum += w.front + w.back + w.alpha;
    }
    benchmark::DoNotOptimize(sum);
  }
  rate(state);
}

void weightsVector(benchmark::State& state) {
  const Segments s = argument(state);
  std::vector<float> front(count), back(count), alpha(count);
  for (auto _ : state) {
    weights(s.x, s.y, front, back, alpha);
    benchmark::DoNotOptimize(front.data());
    benchmark::ClobberMemory();
  }
  rate(state);
}

// All thin, all thick, and mixed in every vector.
BENCHMARK(weightsDouble)->Args({-5, 0})->Args({1, 3})->Args({-5, 3});
BENCHMARK(weightsFloat)->Args({-5, 0})->Args({1, 3})->Args({-5, 3});
BENCHMARK(weightsVector)->Args({-5, 0})->Args({1, 3})->Args({-5, 3});

template <class Integrator>
void through(benchmark::State& state, const Integrator& integrator) {
  const Segments s = segments(-3.0, 0.0);
  // Ends a twentieth of the range apart, as in a mesh of a few hundred thousand cells; or anywhere.
  const double reach = state.range(0) != 0 ? 1.0 : 0.05;
  for (auto _ : state) {
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const double front = static_cast<double>(s.front[i]);
      const double back = front + reach * (static_cast<double>(s.back[i]) - front);
      sum += integrator(front, back, static_cast<double>(s.length[i])).color[1];
    }
    benchmark::DoNotOptimize(sum);
  }
  rate(state);
}

void exact(benchmark::State& state, const std::string& look) {
  const TransferFunction tf = preset(look);
  through(state, [&](double f, double b, double l) { return integrate(tf, f, b, l); });
}

void preintegrated(benchmark::State& state, const std::string& look) {
  const Preintegrated table(preset(look), 0.0, 1.0);
  through(state, [&](double f, double b, double l) { return table(f, b, l); });
}

void averaged(benchmark::State& state, const std::string& look) {
  const TransferFunction tf = preset(look);
  through(state, [&](double f, double b, double l) { return average(tf, f, b, l); });
}

BENCHMARK_CAPTURE(exact, viridis, "viridis")->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(exact, comb, "comb")->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(preintegrated, viridis, "viridis")->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(averaged, viridis, "viridis")->Arg(0)->Arg(1);

void makeTable(benchmark::State& state) {
  const TransferFunction tf = preset("viridis");
  for (auto _ : state) {
    const Preintegrated table(tf, 0.0, 1.0, static_cast<std::size_t>(state.range(0)));
    benchmark::DoNotOptimize(table.texels().data());
  }
}
BENCHMARK(makeTable)->Arg(64)->Arg(128)->Unit(benchmark::kMillisecond);

}  // namespace
