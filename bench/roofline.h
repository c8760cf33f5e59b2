// What this machine can do at most, by micro-benchmarks of its own: the yardstick of the other figures.
#pragma once

#include <string>

namespace spillikin::bench {

struct Roofline {
  std::string instructions;             // the widest that Highway chose here: "AVX3", "AVX2", "NEON", ...
  int lanes = 0;                        // floats in a vector
  double flops = 0.0, all_flops = 0.0;  // single-precision multiply-adds, two flops each, per second: one core, all
  double bytes = 0.0, all_bytes = 0.0;  // moved per second by a[i] = b[i] + s c[i] on arrays beyond the caches
};

// Best of several runs each; some seconds. Threads are TBB's.
Roofline measureRoofline();

}  // namespace spillikin::bench
