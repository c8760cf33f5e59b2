// One mesh drawn from many viewpoints in a process of its own, so that the peak of its memory is its own.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace spillikin::bench {

struct FrameJob {
  std::string kind = "grid";  // grid: n^3 cubes of six tetrahedra each, inner points moved; delaunay: n random points
  std::size_t n = 12;
  int size = 1024;   // pixels each way
  int frames = 5;    // after one that is not counted
  bool walk = true;  // where it is the quicker way; else always in an order
};

// Does the job here: sizes, median seconds of every stage, memory. Throws Error.
nlohmann::ordered_json measureFrame(const FrameJob& job);

// Does the job in a child, by running `program frame KIND N SIZE FRAMES WALK`. Throws Error when the child fails.
nlohmann::ordered_json measureFrameApart(const std::string& program, const FrameJob& job);

}  // namespace spillikin::bench
