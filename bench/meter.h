// Time and memory as the reports of this folder measure them.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <vector>

namespace spillikin::bench {

// What a piece of work took: seconds on the wall, and seconds of all cores of this process. The second hardly changes
// when other programs use the machine, so that ratios of it can be trusted where those of the first cannot.
struct Spent {
  double wall = 0.0, cpu = 0.0;
};

inline double processSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

template <class Work>
Spent spentOn(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const double cpu = processSeconds();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), processSeconds() - cpu};
}

// Frames of one contender.
struct Frames {
  std::vector<double> wall, cpu;

  void add(const Spent& spent) {
    wall.push_back(spent.wall);
    cpu.push_back(spent.cpu);
  }
  bool empty() const { return wall.empty(); }
};

// 0 for no values.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

}  // namespace spillikin::bench
