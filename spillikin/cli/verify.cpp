#include "spillikin/cli/verify.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <glm/geometric.hpp>

#include "spillikin/project/camera.h"
#include "spillikin/reference/reference.h"

namespace spillikin::cli {

sort::Tally verify(render::Session& session, const std::function<void(double)>& progress) {
  const sort::Order& order = session.order();
  const mesh::Mesh& mesh = session.drawnMesh();
  const View& view = session.view();
  const project::Camera camera(view);
  const sort::OrderChecker checker(order, mesh.cell_count());
  const reference::RayCaster caster(mesh, session.drawnField());

  struct Local {
    sort::Tally tally;
    std::vector<reference::Interval> intervals;
    std::vector<sort::Crossing> crossings;
  };
  tbb::enumerable_thread_specific<Local> locals;
  std::atomic<int> rows_done{0};
  tbb::parallel_for(0, view.height, [&](int y) {
    Local& local = locals.local();
    for (int x = 0; x < view.width; ++x) {
      caster.intervals(view, x + 0.5, y + 0.5, {}, local.intervals);
      local.crossings.clear();
      for (const auto& i : local.intervals)
        local.crossings.push_back({i.cell, i.enter, i.leave});
      checker.add(x, y, camera.origin(x + 0.5, y + 0.5), glm::normalize(camera.direction(x + 0.5, y + 0.5)),
                  local.crossings, local.tally);
    }
    if (progress) progress(static_cast<double>(++rows_done) / view.height);
  });
  sort::Tally total;
  for (const Local& local : locals)
    total.merge(local.tally);
  return total;
}

}  // namespace spillikin::cli
