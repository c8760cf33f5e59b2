// What was done and how long it took: one struct, and the JSON object that scripts read.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace spillikin::render {

// Times in wall-clock seconds, of the last call that did the stage.
struct Stats {
  std::size_t cells = 0;
  std::map<std::string, std::size_t> cells_by_type;
  std::size_t faces = 0, exterior_faces = 0;

  struct {
    std::string algorithm;
    double seconds = 0.0, prepare_seconds = 0.0, cells_per_second = 0.0;
    std::size_t cycles = 0;
    bool problems_known = false;                       // the algorithm looks at faces
    std::size_t problem_faces = 0, problem_cells = 0;  // that a ray leaves a cell through and enters it again
    std::size_t subdivided_cells = 0;                  // drawn in more than one piece
    bool exact = false;                                // the order is proven
    std::string why;
    // "order": the picture trusts it; "certificate": it is checked and repaired pixel by pixel; "walk": there is none
    std::string road;
  } sort;
  struct {
    double seconds = 0.0;
  } project;
  struct {
    std::string backend, integration;
    double seconds = 0.0;
    std::size_t fragments = 0;
    std::size_t clear_cells = 0;  // left out: nothing of them shows
  } composite;
  struct {
    bool present = false;
    std::size_t flagged = 0, resolved = 0, unresolved = 0;
  } certificate;

  double load_seconds = 0.0;      // reading the file
  double build_seconds = 0.0;     // orientation, adjacency, numbering
  bool adjacency_reused = false;  // the last step had the topology of the one before
  double field_seconds = 0.0;
  double total_seconds = 0.0;  // since the session began, reading included
  std::size_t peak_rss_bytes = 0;
  double bytes_per_cell = 0.0;  // mesh, sorters and what walks are made on
  int threads = 0;
};

// The JSON object of --stats, indented, with a newline at its end.
std::string toJson(const Stats& stats);

// The most memory that the process has held so far, in bytes.
std::size_t peakResidentBytes();

}  // namespace spillikin::render
