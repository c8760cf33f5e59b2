// Damaged files: whatever is done to a file, it is read to a consistent source or refused in one line, soon.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <random>

#include "io_samples.h"
#include "spillikin/base/error.h"
#include "spillikin/io/read.h"

namespace {

using namespace spillikin;
using mesh::Source;
using tests::Sample;
using tests::TempFolder;

std::string inconsistency(const Source& source) {
  const std::size_t cells = source.types.size();
  if (source.offsets.size() != cells + 1 || source.offsets.front() != 0) return "number of offsets";
  if (!std::is_sorted(source.offsets.begin(), source.offsets.end())) return "offsets do not ascend";
  if (source.offsets.back() != source.connectivity.size()) return "last offset";
  if (!source.left_out.empty() && source.left_out.size() != cells) return "left_out";
  for (std::size_t c = 0; c < cells; ++c) {
    if (source.types[c] == mesh::vtk_cell::polyhedron) continue;
    for (std::size_t k = source.offsets[c]; k < source.offsets[c + 1]; ++k) {
      if (source.connectivity[k] >= source.points.size()) return fmt::format("ids of cell {}", c);
    }
  }
  for (const mesh::Array& array : source.arrays) {
    const std::size_t tuples = array.association == mesh::Association::points ? source.points.size() : cells;
    if (array.values.size() != tuples * static_cast<std::size_t>(array.components)) return "array " + array.name;
  }
  return {};
}

// Runs on, at a chance each: a cut, some bytes changed, a digit changed, a stretch doubled or removed.
std::string damaged(std::string bytes, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1)); };
  switch (below(5)) {
    case 0:
      bytes.resize(below(bytes.size()));
      break;
    case 1:
      for (std::size_t k = 1 + below(4); k > 0; --k)
        bytes[below(bytes.size())] = static_cast<char>(random());
      break;
    case 2: {
      std::vector<std::size_t> digits;
      for (std::size_t i = 0; i < bytes.size(); ++i) {
        if (bytes[i] >= '0' && bytes[i] <= '9') digits.push_back(i);
      }
      if (!digits.empty()) bytes[digits[below(digits.size())]] = "0123456789-e"[below(12)];
      break;
    }
    case 3: {
      const std::size_t at = below(bytes.size());
      bytes.insert(at, bytes.substr(at, 1 + below(16)));
      break;
    }
    default:
      bytes.erase(below(bytes.size()), 1 + below(16));
  }
  return bytes;
}

constexpr double longest = 20.0;  // seconds that any of these small files may take, on a busy machine too

class Fuzz : public testing::TestWithParam<Sample> {};

TEST_P(Fuzz, IsReadOrRefused) {
  const Sample& sample = GetParam();
  const char* more = std::getenv("SPILLIKIN_FUZZ_RUNS");
  const int runs = more == nullptr ? 24 : std::atoi(more);
  const char* chosen = std::getenv("SPILLIKIN_FUZZ_SEED");
  const std::uint64_t first = chosen == nullptr ? 1 : std::strtoull(chosen, nullptr, 10);
  const TempFolder folder;
  sample.write(folder);
  int refused = 0;
  for (int run = 0; run < runs; ++run) {
    const std::uint64_t seed = first + static_cast<std::uint64_t>(run);
    std::mt19937_64 random(seed);
    const std::string path = folder / sample.files[random() % sample.files.size()];
    SCOPED_TRACE(fmt::format("SPILLIKIN_FUZZ_SEED={} SPILLIKIN_FUZZ_RUNS=1, {}", seed, path));
    const std::string whole = tests::readText(path);
    tests::writeText(path, damaged(whole, random));
    const auto start = std::chrono::steady_clock::now();
    try {
      EXPECT_EQ(inconsistency(io::readMesh(folder / sample.name)), "");
    } catch (const Error& error) {
      ++refused;
      const std::string text = error.what();
      if (more != nullptr) std::cout << seed << ": " << text << std::endl;
      EXPECT_NE(text.find(folder.path().string()), std::string::npos) << text;
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      EXPECT_NE(text.find(';'), std::string::npos) << "no remedy: " << text;
    }
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    EXPECT_LT(took, longest) << "seconds";
    tests::writeText(path, whole);
  }
  EXPECT_GT(refused, 0);
  RecordProperty("refused", refused);
}

INSTANTIATE_TEST_SUITE_P(All, Fuzz, testing::ValuesIn(tests::samples()), [](const auto& instance) {
  std::string name = instance.param.name;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

}  // namespace
