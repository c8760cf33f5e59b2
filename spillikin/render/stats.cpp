#include "spillikin/render/stats.h"

#include <sys/resource.h>

#include <nlohmann/json.hpp>

namespace spillikin::render {

std::string toJson(const Stats& s) {
  const auto known = [&](std::size_t count) {
    return s.sort.problems_known ? nlohmann::ordered_json(count) : nlohmann::ordered_json();
  };
  nlohmann::ordered_json j;
  j["cells"] = s.cells;
  j["cells_by_type"] = s.cells_by_type;
  j["faces"] = s.faces;
  j["exterior_faces"] = s.exterior_faces;
  j["sort"] = {{"algorithm", s.sort.algorithm},
               {"seconds", s.sort.seconds},
               {"prepare_seconds", s.sort.prepare_seconds},
               {"cells_per_second", s.sort.cells_per_second},
               {"cycles", s.sort.cycles},
               {"problem_faces", known(s.sort.problem_faces)},
               {"problem_cells", known(s.sort.problem_cells)},
               {"subdivided_cells", s.sort.subdivided_cells},
               {"exact", s.sort.exact},
               {"why", s.sort.why},
               {"road", s.sort.road}};
  j["project"] = {{"seconds", s.project.seconds}};
  j["composite"] = {{"backend", s.composite.backend},
                    {"integration", s.composite.integration},
                    {"seconds", s.composite.seconds},
                    {"fragments", s.composite.fragments},
                    {"clear_cells", s.composite.clear_cells}};
  if (s.certificate.present) {
    j["certificate"] = {{"flagged", s.certificate.flagged},
                        {"resolved", s.certificate.resolved},
                        {"unresolved", s.certificate.unresolved}};
  } else {
    j["certificate"] = nullptr;
  }
  j["load_seconds"] = s.load_seconds;
  j["build_seconds"] = s.build_seconds;
  j["adjacency_reused"] = s.adjacency_reused;
  j["field_seconds"] = s.field_seconds;
  j["total_seconds"] = s.total_seconds;
  j["peak_rss_bytes"] = s.peak_rss_bytes;
  j["bytes_per_cell"] = s.bytes_per_cell;
  j["threads"] = s.threads;
  return j.dump(2) + "\n";
}

std::size_t peakResidentBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

}  // namespace spillikin::render
