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
  add(CellType::polyhedron, own, file);
  polyhedron_index.resize(type.size(), none);
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

// Polygons of five and more corners as the triangles that they are stored as.
Polygons fanned(const Polygons& polygons) {
  Polygons result;
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    if (polygons[i].size() <= 4) {
      result.add(polygons[i]);
    } else {
      forEachTriangle(polygons[i], [&](Id a, Id b, Id c) { result.add(std::array<Id, 3>{a, b, c}); });
    }
  }
  return result;
}

}  // namespace

void IrregularCells::addCollapsed(std::size_t cell) {
  Polygons polygons;
  cells_.forEachPolygon(cell, [&](std::span<const Id> polygon) { polygons.add(polygon); });
  const Id file_id = cells_.file_id[cell];
  cells_.dropped[cell] = 1;
  const std::size_t added = addParts(reduced(onePerPlace(polygons, numbering_)), file_id);
  ++(added > 0 ? report_.collapsed : report_.degenerate);
}

void IrregularCells::addPolyhedron(const Polygons& polygons, Id file_id) {
  Polygons around = reduced(onePerPlace(polygons, numbering_));
  // NOLINTNEXTLINE(bugprone-branch-clone): the reasons are told apart
  if (around.size() < 4) {
    ++report_.degenerate;
  } else if (!orientTogether(around)) {
    ++report_.unclosed;
  } else if (add(around, file_id) == 0) {
    ++report_.degenerate;
  }
}

std::size_t IrregularCells::addParts(const Polygons& polygons, Id file_id) {
  std::size_t added = 0;
  for (Polygons& part : parts(polygons)) {
    if (part.size() >= 4 && orientTogether(part)) added += add(part, file_id);
  }
  return added;
}

std::size_t IrregularCells::add(const Polygons& polygons, Id file_id) {
  if (const std::optional<Recognised> known = recognise(polygons)) {
    cells_.add(known->type, known->vertices, file_id);
    return 1;
  }
  // A triangle of one polygon's fan may lie on another face: a cell would be its own neighbour there.
  const Polygons fans = fanned(polygons);
  const Polygons apart = reduced(fans);
  if (apart.size() < fans.size()) return addParts(apart, file_id);
  cells_.addPolyhedron(polygons, file_id);
  return 1;
}

}  // namespace spillikin::mesh
