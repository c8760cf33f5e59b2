// Cells without a fixed form: collapsed ones and polyhedra become the simplest cell that has their faces.
#include <algorithm>
#include <map>

#include "spillikin/mesh/raw_cells.h"

namespace spillikin::mesh {

void RawCells::add(CellType cell_type, std::span<const Id> vertices, Id file) {
  type.push_back(cell_type);
  vertex.insert(vertex.end(), vertices.begin(), vertices.end());
  offset.push_back(static_cast<Id>(vertex.size()));
  file_id.push_back(file);
  dropped.push_back(0);
  if (!polyhedron_index.empty()) polyhedron_index.push_back(none);
}

void RawCells::addPolyhedron(const Polygons& around, Id file) {
  std::vector<Id> own = around.vertex;
  std::sort(own.begin(), own.end());
  own.erase(std::unique(own.begin(), own.end()), own.end());
  if (polyhedron_index.empty()) polyhedron_index.assign(type.size(), none);
  add(CellType::polyhedron, own, file);
  polyhedron_index.back() = static_cast<Id>(polyhedron_polygons.size() - 1);
  for (std::size_t i = 0; i < around.size(); ++i)
    polygons.add(around[i]);
  polyhedron_polygons.push_back(static_cast<Id>(polygons.size()));
}

bool IrregularCells::collapsed(std::span<const Id> vertices) const {
  for (std::size_t i = 1; i < vertices.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (numbering_.placeOf(vertices[i]) == numbering_.placeOf(vertices[j])) return true;
    }
  }
  return false;
}

namespace {

// Of vertices at one place, the cell keeps the one that its polygons name first.
Polygons onePerPlace(const Polygons& polygons, const Numbering& numbering) {
  Polygons result = polygons;
  if (numbering.place.empty()) return result;
  std::map<Id, Id> vertex_at;
  for (Id& v : result.vertex)
    v = vertex_at.try_emplace(numbering.placeOf(v), v).first->second;
  return result;
}

}  // namespace

void IrregularCells::addCollapsed(std::size_t cell) {
  Polygons polygons;
  cells_.forEachPolygon(cell, [&](std::span<const Id> polygon) { polygons.add(polygon); });
  const Id file_id = cells_.file_id[cell];
  cells_.dropped[cell] = 1;
  polygons = reduced(onePerPlace(polygons, numbering_));
  if (polygons.size() < 4) {
    ++report_.degenerate;
    return;
  }
  ++report_.collapsed;
  for (Polygons& part : parts(polygons)) {
    if (orientTogether(part)) add(part, file_id);
  }
}

void IrregularCells::addPolyhedron(const Polygons& polygons, Id file_id) {
  Polygons around = reduced(onePerPlace(polygons, numbering_));
  if (around.size() < 4) {
    ++report_.degenerate;
  } else if (!orientTogether(around)) {
    ++report_.unclosed;
  } else {
    add(around, file_id);
  }
}

void IrregularCells::add(const Polygons& polygons, Id file_id) {
  if (const std::optional<Recognised> known = recognise(polygons)) {
    cells_.add(known->type, known->vertices, file_id);
  } else {
    cells_.addPolyhedron(polygons, file_id);
  }
}

}  // namespace spillikin::mesh
