#include "spillikin/sort/mpvo.h"

#include <utility>

#include "spillikin/sort/cycles.h"

namespace spillikin::sort {

Mpvo::Mpvo(const mesh::Mesh& mesh, Convexity convexity, CurvedCells curved)
    : mesh_(mesh),
      convexity_(std::move(convexity)),
      signs_(mesh),
      layered_(mesh),
      problems_(mesh, signs_, curved),
      parted_(mesh, signs_, problems_.faces()) {}

void Mpvo::operator()(const Viewpoint& viewpoint, Order& order) {
  order.cycles.clear();
  signs_(viewpoint);
  problems_.begin(order);
  if (!problems_.subdivides()) parted_.part();
  order.exact = convexity_.convex;
  const bool all = layered_(signs_, order, nullptr, nullptr, &parted_);
  parted_.list(order);
  if (!all && !appendLeft(mesh_, signs_, layered_, nullptr, problems_, viewpoint, order)) order.exact = false;
  problems_.end();
}

std::string Mpvo::why() const {
  if (convexity_.convex) return "the mesh is convex, so that every ray runs from cell to cell through shared faces";
  return "the mesh is not convex (" + convexity_.why + "), and faces order nothing across empty space";
}

}  // namespace spillikin::sort
