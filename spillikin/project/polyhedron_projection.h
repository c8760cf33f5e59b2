// Any convex polyhedron on the screen: the paper's own method (Max, Williams, Silva 2000, section II).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spillikin/mesh/planar_subdivision.h"
#include "spillikin/project/cell_on_screen.h"
#include "spillikin/project/regions.h"

namespace spillikin::project {

// What is projected as one face.
enum class Faces : std::uint8_t {
  triangles,  // every boundary triangle: front and back scalar are linear on each face of a region
  planar,     // triangles of one plane together: the paper's polygons, fewer, exact at their vertices
};

// Inserts the projected edges into a winged-edge subdivision and gives each bounded region its front and its back face.
// Reused from cell to cell, it stops allocating. Cost: the edges times the edges that they cross.
class PolyhedronProjection {
 public:
  // Appends the regions of a cell that lies wholly in front of the eye and returns true; appends nothing and returns
  // false when it is not seen as a convex body (a ray may cross it twice, or a region is not convex).
  bool operator()(const CellOnScreen& cell, const Camera& camera, Faces faces, Regions& out);

 private:
  using Local = CellOnScreen::Local;
  static constexpr std::uint32_t none = 0xFFFFFFFFU;
  struct Edge {
    Local a = 0, b = 0;
    std::uint32_t left = none, right = none;  // the triangles that walk it from a to b, and back
    std::uint32_t segment = none;             // of the subdivision
  };
  struct Region {
    std::uint32_t front = none, back = none;  // triangles
  };

  void findEdges(const CellOnScreen& cell);
  void joinFlatTriangles(const CellOnScreen& cell);
  void insertEdges(const CellOnScreen& cell);
  bool chooseFaces(const CellOnScreen& cell);
  std::uint32_t covering(const CellOnScreen& cell, std::size_t region, const Vec2& middle, int facing) const;
  std::uint32_t coveringExactly(std::size_t region, int facing) const;
  bool covers(std::uint32_t face, int facing, std::size_t region) const;
  const Sample& sample(const CellOnScreen& cell, mesh::PlanarSubdivision::Index vertex, std::uint32_t triangle,
                       unsigned end);
  Sample sampleFace(const CellOnScreen& cell, mesh::PlanarSubdivision::Index vertex, std::uint32_t face) const;
  bool sampleExactly(const CellOnScreen& cell, mesh::PlanarSubdivision::Index vertex, std::uint32_t triangle,
                     Sample& found) const;

  std::vector<Edge> edges_;
  std::vector<std::uint32_t> face_;     // per triangle: the lowest triangle of its face
  std::vector<mesh::SignedArea> area_;  // per triangle, on the screen: -1 faces the viewer, 1 away, 0 is edge-on
  double thin_ = 0.0;                   // area below which barycentric coordinates are lost in rounding
  std::vector<std::uint32_t> edge_of_segment_;
  std::vector<std::uint8_t> inserted_;
  std::vector<Vec2> position_;  // of the subdivision's vertices
  std::vector<Region> regions_;
  // Per vertex the last sample of a front and of a back face: most regions around a vertex share one of them.
  struct Known {
    std::uint32_t face = none;
    Sample sample;
  };
  std::vector<std::array<Known, 2>> known_;
  mesh::PlanarSubdivision subdivision_;
};

}  // namespace spillikin::project
