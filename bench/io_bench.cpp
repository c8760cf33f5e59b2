// Reading and writing: what isolation costs, and what a picture costs.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdio>
#include <string>

#include "spillikin/io/read.h"
#include "spillikin/io/write_image.h"

namespace {

using namespace spillikin;

void readMesh(benchmark::State& state, const char* file, bool isolate) {
  io::ReadOptions options;
  options.isolate = isolate;
  std::size_t cells = 0;
  for (auto _ : state) {
    const mesh::Source source = io::readMesh(std::string(SPILLIKIN_EXAMPLES "/") + file, options);
    cells += source.types.size();
  }
  state.counters["cells/s"] = benchmark::Counter(static_cast<double>(cells), benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(readMesh, vts_isolated, "bluntfin.vts", true)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(readMesh, vts_here, "bluntfin.vts", false)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(readMesh, exodus_isolated, "disk_out_ref.ex2", true)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(readMesh, exodus_here, "disk_out_ref.ex2", false)->Unit(benchmark::kMillisecond)->UseRealTime();

void writeImage(benchmark::State& state, const char* suffix) {
  Image image(1024, 768);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      float* pixel = image.pixel(x, y);
      pixel[3] = static_cast<float>(x) / 1024.0F;
      for (int c = 0; c < 3; ++c)
        pixel[c] = pixel[3] * static_cast<float>(y * (c + 1) % 768) / 768.0F;
    }
  }
  const std::string path = "/tmp/spillikin_bench_" + std::to_string(getpid()) + suffix;
  for (auto _ : state)
    io::writeImage(path, image);
  std::remove(path.c_str());
}
BENCHMARK_CAPTURE(writeImage, png, ".png")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(writeImage, exr, ".exr")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(writeImage, npy, ".npy")->Unit(benchmark::kMillisecond);

}  // namespace
