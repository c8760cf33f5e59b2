// The polygons around one cell that has no fixed form yet: a collapsed cell, a polyhedron, a hull. Inside of building a
// mesh. All functions are meant for the handful of polygons of one cell.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "spillikin/mesh/mesh.h"

namespace spillikin::mesh {

struct Polygons {
  std::vector<Id> offset{0};
  std::vector<Id> vertex;

  std::size_t size() const { return offset.size() - 1; }
  std::span<const Id> operator[](std::size_t i) const {
    return {vertex.data() + offset[i], vertex.data() + offset[i + 1]};
  }
  std::span<Id> operator[](std::size_t i) { return {vertex.data() + offset[i], vertex.data() + offset[i + 1]}; }
  void add(std::span<const Id> polygon);
  void clear();
};

// Leaves what bounds a volume: a polygon that comes back to a vertex is cut there into simple ones, those of less than
// three corners go, and two with the same corners in the same or the opposite round cancel.
Polygons reduced(const Polygons& polygons);

// Turns polygons round until neighbours agree on their common edge. False when they do not close: some edge has not
// one polygon on each side.
bool orientTogether(Polygons& polygons);

// The parts that are joined by edges. Polygons must agree on their edges.
std::vector<Polygons> parts(const Polygons& polygons);

// The fixed form that outward (or all inward) polygons have, with its vertices in VTK's order; none for any other.
struct Recognised {
  CellType type;
  std::vector<Id> vertices;
};
std::optional<Recognised> recognise(const Polygons& polygons);

}  // namespace spillikin::mesh
