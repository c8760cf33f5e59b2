// The proof of an order: every pixel's ray against it.
#pragma once

#include <functional>

#include "spillikin/render/session.h"
#include "spillikin/sort/checker.h"

namespace spillikin::cli {

// All pairs of cells on the ray of every pixel of the session's view, by the ground truth's intervals, against the
// session's order. Cells are those of session.drawnMesh().
sort::Tally verify(render::Session& session, const std::function<void(double)>& progress);

}  // namespace spillikin::cli
