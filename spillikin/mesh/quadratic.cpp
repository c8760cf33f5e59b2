// Node orders are those of VTK's cell classes; shape functions those of the serendipity elements (8-node face, 20-node
// body) and, for the 24-node hexahedron, its own.
#include "spillikin/mesh/quadratic.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

namespace spillikin::mesh {
namespace {

using Local4 = std::array<std::uint8_t, 4>;

// A quadrilateral face: corners, the nodes in the middle of their edges, and where the full type has the face's centre.
struct Face {
  Local4 corner, middle;
  std::uint8_t centre;
};

constexpr std::array<Face, 6> hexahedron_faces{{{{0, 4, 7, 3}, {16, 15, 19, 11}, 20},
                                                {{1, 2, 6, 5}, {9, 18, 13, 17}, 21},
                                                {{0, 1, 5, 4}, {8, 17, 12, 16}, 22},
                                                {{3, 7, 6, 2}, {19, 14, 18, 10}, 23},
                                                {{0, 3, 2, 1}, {11, 10, 9, 8}, 24},
                                                {{4, 5, 6, 7}, {12, 13, 14, 15}, 25}}};
constexpr std::array<Face, 3> wedge_faces{
    {{{0, 1, 4, 3}, {6, 13, 9, 12}, 15}, {{1, 2, 5, 4}, {7, 14, 10, 13}, 16}, {{2, 0, 3, 5}, {8, 12, 11, 14}, 17}}};
constexpr std::array<Face, 1> pyramid_faces{{{{0, 1, 2, 3}, {5, 6, 7, 8}, 13}}};

// The faces of the type that have a centre when it is complete, whether the file gives it or not.
std::span<const Face> facesWithCentre(std::uint8_t type) {
  using namespace vtk_cell;
  switch (type) {
    case quadratic_hexahedron:
    case biquadratic_quadratic_hexahedron:
    case triquadratic_hexahedron:
      return hexahedron_faces;
    case quadratic_wedge:
    case biquadratic_quadratic_wedge:
      return wedge_faces;
    case quadratic_pyramid:
    case triquadratic_pyramid:
      return pyramid_faces;
    default:
      return {};
  }
}

template <std::size_t n>
std::array<Id, n> pick(const std::vector<Id>& nodes, const std::array<std::uint8_t, n>& local) {
  std::array<Id, n> result;
  for (std::size_t i = 0; i < n; ++i)
    result[i] = nodes[local[i]];
  return result;
}

template <std::size_t m, std::size_t n>
void addCells(CellType type, const std::vector<Id>& nodes, const std::array<std::array<std::uint8_t, n>, m>& cells,
              Id file_id, LinearCells& out) {
  for (const auto& cell : cells)
    out.add(type, pick(nodes, cell), file_id);
}

}  // namespace

unsigned quadraticNodes(std::uint8_t type) {
  using namespace vtk_cell;
  switch (type) {
    case quadratic_tetra:
      return 10;
    case quadratic_hexahedron:
      return 20;
    case quadratic_wedge:
      return 15;
    case quadratic_pyramid:
      return 13;
    case triquadratic_hexahedron:
      return 27;
    case quadratic_linear_wedge:
      return 12;
    case biquadratic_quadratic_wedge:
      return 18;
    case biquadratic_quadratic_hexahedron:
      return 24;
    case triquadratic_pyramid:
      return 19;
    default:
      return 0;
  }
}

QuadraticCells::Corners QuadraticCells::corners(std::span<const std::uint32_t> nodes, const Local4& local) const {
  Corners result;
  for (std::size_t i = 0; i < 4; ++i)
    result[i] = numbering_.vertex[nodes[local[i]]];
  std::sort(result.begin(), result.end());
  return result;
}

void QuadraticCells::knowCentres(std::uint8_t type, std::span<const std::uint32_t> nodes) {
  for (const Face& face : facesWithCentre(type)) {
    if (face.centre < nodes.size()) centre_.try_emplace(corners(nodes, face.corner), nodes[face.centre]);
  }
}

Id QuadraticCells::make(std::vector<Share> shares) {
  for (Share& share : shares)
    share.point = numbering_.vertex[share.point];
  std::sort(shares.begin(), shares.end(), [](const Share& a, const Share& b) { return a.point < b.point; });
  for (Share& share : shares)
    share.point = numbering_.point[share.point];
  return pool_.make(shares);
}

Id QuadraticCells::faceCentre(std::span<const std::uint32_t> nodes, const Local4& corner, const Local4& middle) {
  const auto [at, missing] = centre_.try_emplace(corners(nodes, corner), none);
  if (missing) {
    std::vector<Share> shares;
    for (const std::uint8_t k : corner)
      shares.push_back({nodes[k], -0.25});
    for (const std::uint8_t k : middle)
      shares.push_back({nodes[k], 0.5});
    at->second = make(std::move(shares));
  }
  return at->second;
}

void QuadraticCells::subdivide(std::uint8_t type, std::span<const std::uint32_t> nodes, Id file_id, LinearCells& out) {
  std::vector<Id> all(nodes.begin(), nodes.end());
  for (const Face& face : facesWithCentre(type)) {
    if (all.size() <= face.centre) all.resize(face.centre + 1U, none);
    if (face.centre >= nodes.size()) all[face.centre] = faceCentre(nodes, face.corner, face.middle);
  }
  using namespace vtk_cell;
  switch (type) {
    case quadratic_tetra:
      return tetrahedron(all, file_id, out);
    case quadratic_hexahedron:
    case biquadratic_quadratic_hexahedron:
    case triquadratic_hexahedron:
      return hexahedron(all, type, file_id, out);
    case quadratic_pyramid:
    case triquadratic_pyramid:
      return pyramid(all, file_id, out);
    default:
      return wedge(all, type, file_id, out);
  }
}

void QuadraticCells::tetrahedron(const std::vector<Id>& nodes, Id file_id, LinearCells& out) const {
  constexpr std::array<Local4, 4> at_corners{{{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3}}};
  addCells(CellType::tetrahedron, nodes, at_corners, file_id, out);
  // The octahedron in the middle is cut along one of its three diagonals, which no neighbour sees: the one whose
  // smallest tetrahedron is largest.
  constexpr std::array<std::array<std::uint8_t, 6>, 3> diagonal_and_ring{
      {{4, 9, 5, 6, 7, 8}, {5, 7, 8, 9, 6, 4}, {6, 8, 4, 5, 9, 7}}};
  std::array<Local4, 4> best{};
  double best_quality = -std::numeric_limits<double>::infinity();
  for (const auto& d : diagonal_and_ring) {
    std::array<Local4, 4> cut;
    double total = 0.0, least = std::numeric_limits<double>::infinity(), most = -least;
    for (std::size_t i = 0; i < 4; ++i) {
      cut[i] = {d[0], d[1], d[2 + i], d[2 + (i + 1) % 4]};
      const std::array<Id, 4> v = pick(nodes, cut[i]);
      const Vec3& o = pool_[v[0]];
      const double volume = glm::dot(pool_[v[1]] - o, glm::cross(pool_[v[2]] - o, pool_[v[3]] - o));
      total += volume;
      least = std::min(least, volume);
      most = std::max(most, volume);
    }
    const double quality = total >= 0.0 ? least : -most;
    if (quality > best_quality) best_quality = quality, best = cut;
  }
  if (best_quality == -std::numeric_limits<double>::infinity())
    best = {{{4, 9, 5, 6}, {4, 9, 6, 7}, {4, 9, 7, 8}, {4, 9, 8, 5}}};
  addCells(CellType::tetrahedron, nodes, best, file_id, out);
}

void QuadraticCells::hexahedron(std::vector<Id>& nodes, std::uint8_t type, Id file_id, LinearCells& out) {
  if (type != vtk_cell::triquadratic_hexahedron) {
    std::vector<Share> shares;
    if (type == vtk_cell::quadratic_hexahedron) {
      for (std::size_t k = 0; k < 20; ++k)
        shares.push_back({nodes[k], k < 8 ? -0.25 : 0.25});
    } else {
      for (std::size_t k = 16; k < 24; ++k)
        shares.push_back({nodes[k], k < 20 ? -0.25 : 0.5});
    }
    nodes.push_back(make(std::move(shares)));
  }
  // The 27 nodes as a lattice, x fastest.
  constexpr std::array<std::uint8_t, 27> lattice{0,  8,  1,  11, 24, 9,  3, 10, 2,  16, 22, 17, 20, 26,
                                                 21, 19, 23, 18, 4,  12, 5, 15, 25, 13, 7,  14, 6};
  constexpr std::array<std::uint8_t, 8> corner{0, 1, 4, 3, 9, 10, 13, 12};
  for (const std::uint8_t origin : corner) {
    std::array<Id, 8> cell;
    for (std::size_t k = 0; k < 8; ++k)
      cell[k] = nodes[lattice[origin + corner[k]]];
    out.add(CellType::hexahedron, cell, file_id);
  }
}

void QuadraticCells::wedge(std::vector<Id>& nodes, std::uint8_t type, Id file_id, LinearCells& out) {
  constexpr std::array<std::array<std::uint8_t, 6>, 4> upright{
      {{0, 6, 8, 3, 9, 11}, {6, 1, 7, 9, 4, 10}, {8, 7, 2, 11, 10, 5}, {6, 7, 8, 9, 10, 11}}};
  constexpr std::array<std::array<std::uint8_t, 6>, 8> halves{{{0, 6, 8, 12, 15, 17},
                                                               {6, 1, 7, 15, 13, 16},
                                                               {8, 7, 2, 17, 16, 14},
                                                               {6, 7, 8, 15, 16, 17},
                                                               {12, 15, 17, 3, 9, 11},
                                                               {15, 13, 16, 9, 4, 10},
                                                               {17, 16, 14, 11, 10, 5},
                                                               {15, 16, 17, 9, 10, 11}}};
  if (type == vtk_cell::quadratic_linear_wedge) {
    addCells(CellType::wedge, nodes, upright, file_id, out);
  } else {
    addCells(CellType::wedge, nodes, halves, file_id, out);
  }
}

void QuadraticCells::pyramid(std::vector<Id>& nodes, Id file_id, LinearCells& out) {
  constexpr std::array<std::array<std::uint8_t, 5>, 6> pyramids{{{0, 5, 13, 8, 9},
                                                                 {5, 1, 6, 13, 10},
                                                                 {13, 6, 2, 7, 11},
                                                                 {8, 13, 7, 3, 12},
                                                                 {9, 10, 11, 12, 4},
                                                                 {9, 12, 11, 10, 13}}};
  constexpr std::array<Local4, 4> tetrahedra{{{5, 9, 10, 13}, {6, 10, 11, 13}, {7, 11, 12, 13}, {8, 12, 9, 13}}};
  addCells(CellType::pyramid, nodes, pyramids, file_id, out);
  addCells(CellType::tetrahedron, nodes, tetrahedra, file_id, out);
}

}  // namespace spillikin::mesh
