// Frames of Spillikin and of VTK's mappers in turn: one machine, one run, one mesh, camera and transfer function.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/peers/subjects.h"

namespace spillikin::bench {

struct SpeedOptions {
  int size = 1024;              // pixels each way
  int rounds = 3;               // each draws one frame of every peer and three of Spillikin, each from a new viewpoint
  double limit_seconds = 60.0;  // a peer whose frame takes longer is given up
  std::size_t most_cells = 0;   // larger meshes are left out; 0: none
};

// Measures one subject. Throws Error when it cannot be made or drawn.
nlohmann::ordered_json measureSpeed(const Subject& subject, const SpeedOptions& options);

// The visibility orders of one subject alone: a matter of seconds.
nlohmann::ordered_json measureOrders(const Subject& subject, const SpeedOptions& options);

// The report: Markdown tables of what measureSpeed gave.
std::string speedTables(const nlohmann::ordered_json& all);
// Its part about visibility orders.
std::string orderTables(const nlohmann::ordered_json& all);

}  // namespace spillikin::bench
