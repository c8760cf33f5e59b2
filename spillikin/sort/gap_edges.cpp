#include "spillikin/sort/gap_edges.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "spillikin/mesh/place.h"
#include "spillikin/mesh/predicates.h"

namespace spillikin::sort {
namespace {

constexpr std::size_t block = 64;  // triangles searched by one task, whose edges are kept together
// A normal is not relied on where its sides span less than this sine, so that it is wrong by less than 1e-9; a height
// over its plane is then, and rounding included, by less than `clear` times the extent of the exterior.
constexpr double least_sine = 1e-6, clear = 1e-8;

// Zero where it is not relied on.
Vec3 unitNormal(const Triangle& t) {
  const Vec3 u = t[1] - t[0], v = t[2] - t[0];
  const Vec3 n(u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x);
  const auto length = [](const Vec3& a) { return std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); };
  return length(n) > least_sine * length(u) * length(v) ? n / length(n) : Vec3(0.0);
}

}  // namespace

GapEdges::GapEdges(const mesh::Mesh& mesh, const FaceSigns& signs, Exterior exterior)
    : mesh_(mesh), signs_(signs), tree_(mesh, exteriorTriangles(mesh)) {
  pairNonmatching();
  overlapping_ = findOverlapping();
  if (exterior == Exterior::facing) keepFacing();
  index();
  windows_.emplace(mesh, tree_, [this](std::uint32_t a, std::uint32_t b) { return mayFace(a, b); });
}

void GapEdges::keepFacing() {
  std::vector<std::uint8_t> facing(tree_.triangles().size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, facing.size(), 256),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t t = range.begin(); t < range.end(); ++t)
                        facing[t] = facesAny(static_cast<std::uint32_t>(t)) ? 1 : 0;
                    });
  tree_.keep(facing);
  pairNonmatching();
}

void GapEdges::index() {
  const auto& triangles = tree_.triangles();
  row_ = exteriorRows(mesh_, signs_, triangles);
  by_cell_.resize(triangles.size());
  std::iota(by_cell_.begin(), by_cell_.end(), 0U);
  std::sort(by_cell_.begin(), by_cell_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return triangles[a].cell != triangles[b].cell ? triangles[a].cell < triangles[b].cell : a < b;
  });
  first_of_.assign(mesh_.cell_count() + 1, 0);
  for (const auto& t : triangles)
    ++first_of_[t.cell + 1];
  for (std::size_t c = 0; c < mesh_.cell_count(); ++c)
    first_of_[c + 1] += first_of_[c];
  found_.resize((triangles.size() + block - 1) / block);
  const Vec3 size = tree_.upper() - tree_.lower();
  clear_ = clear * std::sqrt(size.x * size.x + size.y * size.y + size.z * size.z);
  normal_.reserve(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    normal_.push_back(unitNormal(tree_.corners(t)));
}

void GapEdges::pairNonmatching() {
  const auto& triangles = tree_.triangles();
  partner_.assign(triangles.size(), mesh::none);
  abutting_.clear();
  if (mesh_.quad.empty() || mesh_.triangle.empty()) return;
  const auto key = [&](std::array<mesh::Id, 3> corner) {
    for (mesh::Id& v : corner)
      v = mesh::place(mesh_, v);
    std::sort(corner.begin(), corner.end());
    return corner;
  };
  std::map<std::array<mesh::Id, 3>, mesh::Id> quads;  // by three of their corners
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (triangles[t].face < mesh_.triangle_count()) continue;
    const auto& q = mesh_.quad[triangles[t].face - mesh_.triangle_count()];
    for (std::size_t k = 0; k < 4; ++k)
      quads[key({q[k], q[(k + 1) % 4], q[(k + 2) % 4]})] = triangles[t].face;
    partner_[t] = triangles[t].face;
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (triangles[t].face >= mesh_.triangle_count()) continue;
    const auto quad = quads.find(key(triangles[t].corner));
    if (quad != quads.end()) partner_[t] = quad->second;
  }
  std::multimap<mesh::Id, std::uint32_t> by_partner;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (partner_[t] == mesh::none) continue;
    const auto [first, last] = by_partner.equal_range(partner_[t]);
    for (auto other = first; other != last; ++other) {
      if (triangles[other->second].cell != triangles[t].cell) abutting_.emplace_back(other->second, t);
    }
    by_partner.emplace(partner_[t], t);
  }
}

std::array<mesh::Id, 2> GapEdges::findOverlapping() const {
  const auto& triangles = tree_.triangles();
  for (const auto& [a, b] : tree_.crossings(triangles.size())) {
    if (partner_[a] != mesh::none && partner_[a] == partner_[b]) continue;
    return {triangles[a].cell, triangles[b].cell};
  }
  return {mesh::none, mesh::none};
}

std::span<const std::uint32_t> GapEdges::trianglesOf(mesh::Id cell) const {
  return {by_cell_.data() + first_of_[cell], by_cell_.data() + first_of_[cell + 1]};
}

// Does the other triangle lie on the mesh's side of the plane of this one, partly in it at most? Rays that leave or
// enter the mesh through this one do not meet it then. What neighbours share lies in the plane.
template <class Orient>
GapEdges::Beside GapEdges::within(std::uint32_t triangle, std::uint32_t other, const Orient& orient) const {
  const auto& corner = tree_.triangles()[triangle].corner;
  const Triangle plane = tree_.corners(triangle);
  bool any = false, unsure = false;
  for (const mesh::Id v : tree_.triangles()[other].corner) {
    if (v == corner[0] || v == corner[1] || v == corner[2]) continue;
    const int s = orient(plane[0], plane[1], plane[2], mesh_.points[v]);
    if (s == 1) return Beside::no;
    any = any || s == -1;
    unsure = unsure || s == 2;
  }
  return unsure ? Beside::unsure : any ? Beside::yes : Beside::no;
}

// Does one of them not reach beyond the plane of the other?
bool GapEdges::turnedAway(std::uint32_t a, std::uint32_t b) const {
  return within(a, b, mesh::orient3d) == Beside::yes || within(b, a, mesh::orient3d) == Beside::yes;
}

bool GapEdges::facesAny(std::uint32_t t) const {
  return tree_.anyBeyond(t, [&](std::uint32_t other) {
    return tree_.triangles()[other].cell != tree_.triangles()[t].cell && (oneFace(t, other) || !turnedAway(t, other));
  });
}

// The same of two triangles; true as well where a corner lies too near to a plane to be told of cheaply.
bool GapEdges::mayFace(std::uint32_t a, std::uint32_t b) const {
  if (tree_.triangles()[a].cell == tree_.triangles()[b].cell) return false;
  return oneFace(a, b) || (!clearlyWithin(a, b) && !clearlyWithin(b, a));
}

// Does every corner of the other that is not one of this triangle lie well on the mesh's side of its plane? In double,
// where most pairs are decided; a corner nearer to the plane than `clear_` is left to the exact predicates.
bool GapEdges::clearlyWithin(std::uint32_t triangle, std::uint32_t other) const {
  const auto& corner = tree_.triangles()[triangle].corner;
  const Vec3 &n = normal_[triangle], &a = mesh_.points[corner[0]];
  bool any = false;
  for (const mesh::Id v : tree_.triangles()[other].corner) {
    if (v == corner[0] || v == corner[1] || v == corner[2]) continue;
    const Vec3 p = mesh_.points[v] - a;
    if (!(n.x * p.x + n.y * p.y + n.z * p.z < -clear_)) return false;
    any = true;
  }
  return any;
}

bool GapEdges::related(std::uint32_t exit, std::uint32_t entry, const Viewpoint& viewpoint) const {
  const bool one_face = oneFace(exit, entry);
  // First what is cheap and leaves out most: where rounding does not decide, later.
  if (!one_face && (clearlyWithin(entry, exit) || clearlyWithin(exit, entry))) return false;
  Beside front = Beside::no, back = Beside::no;
  if (!one_face) {
    front = within(exit, entry, mesh::orient3dFiltered);
    if (front == Beside::yes) return false;
    back = within(entry, exit, mesh::orient3dFiltered);
    if (back == Beside::yes) return false;
  }
  const Triangle a = tree_.corners(exit), b = tree_.corners(entry);
  const int s = sign(exit), t = sign(entry);
  if (!seenTogether(a, b, viewpoint, std::min(sliver(a), sliver(b)))) return false;
  const bool unsure = front == Beside::unsure || back == Beside::unsure;
  if (unsure && turnedAway(exit, entry)) return false;
  if (!one_face && nearer(a, s, b, t, viewpoint) < 0) return false;
  return projectionsOverlap(a, s, b, t, viewpoint);
}

// Fills found_: all pairs or, where groups are given, those inside them.
void GapEdges::findAll(const Viewpoint& viewpoint, std::span<const mesh::Id> group) {
  const auto& triangles = tree_.triangles();
  const auto groupOf = [&](std::uint32_t t) { return group.empty() ? 0 : group[triangles[t].cell]; };
  // The tree looks for turns: groups that share one are told apart afterwards.
  const auto turnOf = [&](std::uint32_t t) { return static_cast<Turn>(groupOf(t) % ExteriorWindows::never); };
  windows_->look(viewpoint);
  windows_->setTurns(
      [&](std::uint32_t t) { return sign(t) < 0 && groupOf(t) != mesh::none ? turnOf(t) : ExteriorWindows::never; },
      turnOf);
  tbb::parallel_for(std::size_t{0}, found_.size(), [&](std::size_t b) {
    thread_local std::vector<WindowQuery> queries;
    thread_local std::vector<WindowPair> candidates;
    auto& found = found_[b];
    found.clear();
    queries.clear();
    candidates.clear();
    for (auto n = static_cast<std::uint32_t>(b * block); n < std::min(triangles.size(), (b + 1) * block); ++n) {
      // Rays enter through those turned towards the viewpoint.
      if (sign(n) > 0 && groupOf(n) != mesh::none) queries.push_back({n, turnOf(n), turnOf(n)});
    }
    windows_->meeting(queries, candidates);
    for (const auto& [e, n] : candidates) {
      if (triangles[e].cell == triangles[n].cell || groupOf(e) != groupOf(n)) continue;
      if (related(e, n, viewpoint)) found.emplace_back(triangles[n].cell, triangles[e].cell);
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
  });
}

void GapEdges::inside(const Viewpoint& viewpoint, std::span<const mesh::Id> group, CellPairs& out) {
  findAll(viewpoint, group);
  for (const auto& found : found_)
    out.insert(out.end(), found.begin(), found.end());
}

void GapEdges::operator()(const Viewpoint& viewpoint, ExtraEdges& out) {
  findAll(viewpoint, {});
  CellPairs all;
  for (const auto& found : found_)
    all.insert(all.end(), found.begin(), found.end());
  setEdges(all, mesh_.cell_count(), out);
}

void setEdges(const CellPairs& pairs, std::size_t cells, ExtraEdges& out) {
  out.offset.assign(cells + 1, 0);
  for (const auto& edge : pairs)
    ++out.offset[edge.first + 1];
  for (std::size_t c = 0; c < cells; ++c)
    out.offset[c + 1] += out.offset[c];
  out.successor.resize(out.offset.back());
  for (const auto& [behind, front] : pairs)
    out.successor[out.offset[behind]++] = front;
  for (std::size_t c = cells; c > 0; --c)
    out.offset[c] = out.offset[c - 1];
  out.offset[0] = 0;
}

std::size_t GapEdges::bytes() const {
  std::size_t bytes = tree_.bytes() + windows_->bytes() + normal_.capacity() * sizeof(Vec3) +
                      row_.capacity() * sizeof(std::size_t) + 4 * partner_.capacity() +
                      4 * (by_cell_.capacity() + first_of_.capacity());
  for (const auto& found : found_)
    bytes += found.capacity() * sizeof(found[0]);
  return bytes;
}

std::string overlapMessage(const mesh::Mesh& mesh, const std::array<mesh::Id, 2>& cells) {
  return "cells overlap in space, as " + std::to_string(mesh.cell_file_id[cells[0]]) + " and " +
         std::to_string(mesh.cell_file_id[cells[1]]) + " do, so that no order is right everywhere";
}

}  // namespace spillikin::sort
