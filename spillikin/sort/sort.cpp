#include "spillikin/sort/sort.h"

#include <array>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/sort/bsp_xmpvo.h"
#include "spillikin/sort/convexified.h"
#include "spillikin/sort/mpvo.h"
#include "spillikin/sort/mpvonc.h"
#include "spillikin/sort/newell.h"
#include "spillikin/sort/power.h"
#include "spillikin/sort/simple_orders.h"
#include "spillikin/sort/xmpvo.h"

namespace spillikin::sort {
namespace {

constexpr std::array<std::pair<Algorithm, const char*>, 10> names{{{Algorithm::automatic, "auto"},
                                                                   {Algorithm::mpvo, "mpvo"},
                                                                   {Algorithm::mpvonc, "mpvonc"},
                                                                   {Algorithm::xmpvo, "xmpvo"},
                                                                   {Algorithm::bsp_xmpvo, "bsp-xmpvo"},
                                                                   {Algorithm::power, "power"},
                                                                   {Algorithm::newell, "newell"},
                                                                   {Algorithm::convexified, "convexified"},
                                                                   {Algorithm::centroid, "centroid"},
                                                                   {Algorithm::none, "none"}}};

// The cheapest that is exact for this mesh from every viewpoint, what it takes to prepare it counted: filling the
// outside of a mesh is made up for after hundreds of views (see the README), matching its faces by the first. Power
// distances cost less than half of MPVO, their proof from view to view counted, and are prepared in the same time;
// below `few` cells either takes no time.
std::unique_ptr<Sorter> automatic(const mesh::Mesh& mesh, CurvedCells curved, Convexity found) {
  constexpr std::size_t few = 1000;
  if (!found.convex) {
    if (auto matched = Convexified::withoutFilling(mesh)) return matched;
    return std::make_unique<Xmpvo>(mesh, curved);
  }
  if (mesh.tetrahedral() && mesh.cell_count() >= few) {
    const Regularity lifted = regularity(mesh, {}, true);
    if (lifted.ordered()) return std::make_unique<PowerSort>(mesh, found, lifted);
  }
  return std::make_unique<Mpvo>(mesh, std::move(found), curved);
}

}  // namespace

const char* name(Algorithm algorithm) {
  return names.at(static_cast<std::size_t>(algorithm)).second;
}

Algorithm algorithm(std::string_view name) {
  std::string known;
  for (const auto& [algorithm, text] : names) {
    if (name == text) return algorithm;
    known += known.empty() ? "" : ", ";
    known += text;
  }
  throw Error("no sort is called '" + std::string(name) + "'; the sorts are " + known);
}

std::string why(const Sorter& sorter, const Order& order) {
  if (order.exact || !sorter.exact()) return sorter.why();
  return "cells of a cycle overlap in space, or were too many to be cut apart, and no order is right for them";
}

std::unique_ptr<Sorter> makeSorter(Algorithm algorithm, const mesh::Mesh& mesh, CurvedCells curved,
                                   const Convexity* known) {
  const auto found = [&] { return known != nullptr ? *known : convexity(mesh, exteriorTriangles(mesh)); };
  switch (algorithm) {
    case Algorithm::automatic:
      return automatic(mesh, curved, found());
    case Algorithm::mpvo:
      return std::make_unique<Mpvo>(mesh, found(), curved);
    case Algorithm::xmpvo:
      return std::make_unique<Xmpvo>(mesh, curved);
    case Algorithm::convexified:
      return std::make_unique<Convexified>(mesh);
    case Algorithm::bsp_xmpvo:
      return std::make_unique<BspXmpvo>(mesh);
    case Algorithm::mpvonc:
      return std::make_unique<Mpvonc>(mesh);
    case Algorithm::newell:
      return std::make_unique<Newell>(mesh);
    case Algorithm::power:
      return std::make_unique<PowerSort>(mesh);
    case Algorithm::centroid:
      return std::make_unique<CentroidSort>(mesh);
    case Algorithm::none:
      return std::make_unique<FileOrder>(mesh);
    default:
      break;
  }
  throw Error(std::string("the sort '") + name(algorithm) + "' is not available yet; use --sort auto");
}

}  // namespace spillikin::sort
