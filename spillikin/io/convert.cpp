#include "spillikin/io/convert.h"

#include <fmt/format.h>
#include <vtkArrayDispatch.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCompositeDataIterator.h>
#include <vtkCompositeDataSet.h>
#include <vtkDataArrayRange.h>
#include <vtkDataSet.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkRectilinearGrid.h>
#include <vtkStructuredGrid.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <array>
#include <limits>
#include <regex>

#include "spillikin/base/error.h"

namespace spillikin::io {
namespace {

using mesh::Array;
using mesh::Association;
using mesh::Source;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t max_points = std::numeric_limits<std::uint32_t>::max();

// Where a data set's points and cells begin in the source.
struct Base {
  std::size_t point = 0;
  std::size_t cell = 0;
};

std::size_t size(vtkIdType count) {
  return static_cast<std::size_t>(std::max<vtkIdType>(count, 0));
}

vtkIdType id(std::size_t index) {
  return static_cast<vtkIdType>(index);
}

// ---- Points ---------------------------------------------------------------------------------------------------------

struct CopyValues {
  template <typename ArrayType>
  void operator()(ArrayType* array, double* out) const {
    for (const auto value : vtk::DataArrayValueRange(array))
      *out++ = static_cast<double>(value);
  }
};

void copyValues(vtkDataArray* array, double* out) {
  const CopyValues worker;
  if (!vtkArrayDispatch::Dispatch::Execute(array, worker, out)) worker(array, out);
}

void appendPoints(vtkDataSet* data, Source& source) {
  const std::size_t count = size(data->GetNumberOfPoints());
  const std::size_t before = source.points.size();
  if (count > max_points - before) {
    throw Error(fmt::format("'{}' has more than {} points; cut it into several files", source.name, max_points));
  }
  source.points.resize(before + count);
  if (auto* set = vtkPointSet::SafeDownCast(data)) {
    if (count > 0) copyValues(set->GetPoints()->GetData(), &source.points[before].x);
    return;
  }
  for (std::size_t p = 0; p < count; ++p) {
    data->GetPoint(static_cast<vtkIdType>(p), &source.points[before + p].x);
  }
}

// ---- Cells ----------------------------------------------------------------------------------------------------------

// Checks ids against the number of points of their data set and moves them behind the points before it.
class Ids {
 public:
  Ids(Source& source, Base base) : source_(source), base_(base), count_(source.points.size() - base.point) {}

  void add(vtkIdType id) {
    if (id < 0 || size(id) >= count_) {
      throw Error(
          fmt::format("cell {} of '{}' names point {}, but there are {} points; the file is damaged, export it "
                      "again",
                      source_.types.size(), source_.name, id, count_));
    }
    source_.connectivity.push_back(static_cast<std::uint32_t>(base_.point + size(id)));
  }

  // A number that counts faces or points within a face stream.
  void addCount(vtkIdType count) { source_.connectivity.push_back(static_cast<std::uint32_t>(count)); }

  void endCell(int type) {
    source_.types.push_back(static_cast<std::uint8_t>(type));
    source_.offsets.push_back(source_.connectivity.size());
  }

 private:
  Source& source_;
  Base base_;
  std::size_t count_;
};

[[noreturn]] void damagedCells(const Source& source, const char* what) {
  throw Error(fmt::format("the cells of '{}' are damaged: {}; export the file again", source.name, what));
}

// The face stream of one polyhedron: number of faces, then for each its number of points and the points.
void addPolyhedron(vtkIdTypeArray* faces, vtkIdTypeArray* locations, vtkIdType cell, Ids& ids, const Source& source) {
  const auto bad = [&] { damagedCells(source, "the faces of a polyhedron run beyond their list"); };
  if (faces == nullptr || locations == nullptr || cell >= locations->GetNumberOfValues()) bad();
  const vtkIdType total = faces->GetNumberOfValues();
  vtkIdType at = locations->GetValue(cell);
  if (at < 0 || at >= total) bad();
  const vtkIdType face_count = faces->GetValue(at++);
  if (face_count < 0 || face_count > total) bad();
  ids.addCount(face_count);
  for (vtkIdType f = 0; f < face_count; ++f) {
    if (at >= total) bad();
    const vtkIdType corners = faces->GetValue(at++);
    if (corners < 0 || corners > total - at) bad();
    ids.addCount(corners);
    for (vtkIdType k = 0; k < corners; ++k)
      ids.add(faces->GetValue(at++));
  }
}

struct AppendCells {
  // Offsets and connectivity are VTK's, of 32 or 64 bits.
  template <typename Arrays>
  void operator()(Arrays& arrays, vtkUnstructuredGrid* grid, Source& source, Base base) const {
    auto* offsets = arrays.GetOffsets();
    auto* connectivity = arrays.GetConnectivity();
    vtkUnsignedCharArray* types = grid->GetCellTypesArray();
    const vtkIdType cells = types == nullptr ? 0 : types->GetNumberOfValues();
    if (offsets->GetNumberOfValues() != cells + 1 && !(cells == 0 && offsets->GetNumberOfValues() == 0)) {
      damagedCells(source, "there are not as many types as offsets");
    }
    const vtkIdType total = connectivity->GetNumberOfValues();
    vtkIdTypeArray* faces = grid->GetFaces();
    vtkIdTypeArray* locations = grid->GetFaceLocations();
    source.types.reserve(source.types.size() + size(cells));
    source.offsets.reserve(source.offsets.size() + size(cells));
    source.connectivity.reserve(source.connectivity.size() + size(total));
    Ids ids(source, base);
    for (vtkIdType c = 0; c < cells; ++c) {
      const vtkIdType begin = offsets->GetValue(c), end = offsets->GetValue(c + 1);
      if (begin < 0 || end < begin || end > total) damagedCells(source, "the offsets do not ascend within the list");
      const int type = types->GetValue(c);
      if (type == mesh::vtk_cell::polyhedron) {
        addPolyhedron(faces, locations, c, ids, source);
      } else {
        for (vtkIdType k = begin; k < end; ++k)
          ids.add(connectivity->GetValue(k));
      }
      ids.endCell(type);
    }
  }
};

// Hexahedra of a grid of dims[0] x dims[1] x dims[2] points, i fastest.
void appendHexahedra(const std::array<int, 3>& dims, Source& source, Base base) {
  const auto nx = size(dims[0]), ny = size(dims[1]), nz = size(dims[2]);
  if (source.points.size() - base.point != nx * ny * nz) damagedCells(source, "the dimensions and the points differ");
  Ids ids(source, base);
  for (std::size_t k = 0; k + 1 < nz; ++k) {
    for (std::size_t j = 0; j + 1 < ny; ++j) {
      for (std::size_t i = 0; i + 1 < nx; ++i) {
        const std::size_t at = i + nx * (j + ny * k);
        for (const std::size_t up : {std::size_t{0}, nx * ny}) {
          for (const std::size_t corner : {std::size_t{0}, std::size_t{1}, nx + 1, nx}) {
            ids.add(id(at + up + corner));
          }
        }
        ids.endCell(mesh::vtk_cell::hexahedron);
      }
    }
  }
}

// Whatever else: surfaces, lines, flat grids. They are counted, not drawn, so that speed does not matter.
void appendOtherCells(vtkDataSet* data, Source& source, Base base) {
  Ids ids(source, base);
  vtkNew<vtkIdList> points;
  for (vtkIdType c = 0; c < data->GetNumberOfCells(); ++c) {
    const int type = data->GetCellType(c);
    data->GetCellPoints(c, points);
    for (vtkIdType k = 0; k < points->GetNumberOfIds(); ++k)
      ids.add(points->GetId(k));
    ids.endCell(type);
  }
}

void appendCells(vtkDataSet* data, Source& source, Base base) {
  if (auto* grid = vtkUnstructuredGrid::SafeDownCast(data)) {
    if (vtkCellArray* cells = grid->GetCells()) cells->Visit(AppendCells{}, grid, source, base);
    return;
  }
  std::array<int, 3> dims{};
  if (auto* curvilinear = vtkStructuredGrid::SafeDownCast(data)) curvilinear->GetDimensions(dims.data());
  if (auto* rectilinear = vtkRectilinearGrid::SafeDownCast(data)) rectilinear->GetDimensions(dims.data());
  if (auto* image = vtkImageData::SafeDownCast(data)) image->GetDimensions(dims.data());
  if (std::all_of(dims.begin(), dims.end(), [](int n) { return n > 1; })) {
    appendHexahedra(dims, source, base);
  } else {
    appendOtherCells(data, source, base);
  }
}

// ---- Ghosts and blanking --------------------------------------------------------------------------------------------

vtkUnsignedCharArray* ghosts(vtkDataSetAttributes* attributes, std::size_t count) {
  auto* array = vtkUnsignedCharArray::SafeDownCast(attributes->GetArray(vtkDataSetAttributes::GhostArrayName()));
  return array != nullptr && array->GetNumberOfComponents() == 1 && size(array->GetNumberOfTuples()) == count ? array
                                                                                                              : nullptr;
}

void leaveOut(std::size_t cell, Source& source) {
  if (source.left_out.size() <= cell) source.left_out.resize(cell + 1, 0);
  source.left_out[cell] = 1;
}

// The ids of a cell within the connectivity, also those in a face stream.
template <typename Visit>
void forEachPoint(const Source& source, std::size_t cell, Visit visit) {
  std::size_t at = source.offsets[cell];
  const std::size_t end = source.offsets[cell + 1];
  if (source.types[cell] != mesh::vtk_cell::polyhedron) {
    for (; at < end; ++at)
      visit(source.connectivity[at]);
    return;
  }
  for (++at; at < end;) {
    const std::size_t face_end = at + 1 + source.connectivity[at];
    for (++at; at < face_end; ++at)
      visit(source.connectivity[at]);
  }
}

void markLeftOut(vtkDataSet* data, Source& source, Base base) {
  constexpr unsigned char bad_cell =
      vtkDataSetAttributes::DUPLICATECELL | vtkDataSetAttributes::REFINEDCELL | vtkDataSetAttributes::HIDDENCELL;
  const std::size_t cells = source.types.size() - base.cell;
  if (auto* flags = ghosts(data->GetCellData(), cells)) {
    for (std::size_t c = 0; c < cells; ++c) {
      if ((flags->GetValue(static_cast<vtkIdType>(c)) & bad_cell) != 0) leaveOut(base.cell + c, source);
    }
  }
  auto* flags = ghosts(data->GetPointData(), source.points.size() - base.point);
  if (flags == nullptr) return;
  for (std::size_t c = base.cell; c < source.types.size(); ++c) {
    bool hidden = false;
    forEachPoint(source, c, [&](std::uint32_t id) {
      hidden |= (flags->GetValue(static_cast<vtkIdType>(id - base.point)) & vtkDataSetAttributes::HIDDENPOINT) != 0;
    });
    if (hidden) leaveOut(c, source);
  }
}

// ---- Arrays ---------------------------------------------------------------------------------------------------------

// Whether an array numbers things: so declared, or whole numbers under a name with the word "id" or "ids", whether
// written GlobalNodeId, vtkOriginalCellIds or GLOBAL_IDS_POINTS.
bool isIdentifier(vtkDataSetAttributes* attributes, int index) {
  const int role = attributes->IsArrayAnAttribute(index);
  if (role == vtkDataSetAttributes::GLOBALIDS || role == vtkDataSetAttributes::PEDIGREEIDS) return true;
  vtkDataArray* array = attributes->GetArray(index);
  const int type = array->GetDataType();
  if (array->GetName() == nullptr || type == VTK_FLOAT || type == VTK_DOUBLE) return false;
  static const std::regex word("(^|[^A-Za-z])(ids?|IDS?|Ids?)($|[^A-Za-z])|[a-z]I[dD]s?($|[^a-z])");
  return std::regex_search(array->GetName(), word);
}

// The array of that name in the source, made of NaN up to `before` tuples where it is new. An array whose number of
// components differs from that of its namesake in an earlier block gets a name of its own.
Array& arrayOf(Source& source, const std::string& name, Association association, int components, std::size_t before) {
  const auto find = [&](const std::string& wanted) {
    return std::find_if(source.arrays.begin(), source.arrays.end(),
                        [&](const Array& array) { return array.association == association && array.name == wanted; });
  };
  std::string used = name;
  auto found = find(used);
  if (found != source.arrays.end() && found->components != components) {
    used = fmt::format("{} ({} components)", name, components);
    found = find(used);
  }
  if (found != source.arrays.end()) return *found;
  source.arrays.push_back({used, association, components, {}, false});
  source.arrays.back().values.assign(before * static_cast<std::size_t>(components), nan);
  return source.arrays.back();
}

void appendArrays(vtkDataSetAttributes* attributes, Association association, std::size_t before, std::size_t count,
                  Source& source) {
  for (int i = 0; i < attributes->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = attributes->GetArray(i);  // null for strings and the like
    if (array == nullptr || array->GetNumberOfComponents() < 1) continue;
    const std::string name = array->GetName() == nullptr ? "unnamed" : array->GetName();
    if (name == vtkDataSetAttributes::GhostArrayName()) continue;
    if (size(array->GetNumberOfTuples()) != count) {
      throw Error(fmt::format("array '{}' of '{}' has {} tuples for {} {}; the file is damaged, export it again", name,
                              source.name, array->GetNumberOfTuples(), count,
                              association == Association::points ? "points" : "cells"));
    }
    const int components = array->GetNumberOfComponents();
    Array& out = arrayOf(source, name, association, components, before);
    const std::size_t start = before * static_cast<std::size_t>(components);
    if (out.values.size() != start) continue;  // a second array of the same name in one block
    out.identifier |= isIdentifier(attributes, i);
    out.values.resize(start + count * static_cast<std::size_t>(components));
    if (count > 0) copyValues(array, out.values.data() + start);
  }
}

// Arrays that this block did not have.
void fillArrays(Source& source) {
  for (Array& array : source.arrays) {
    const std::size_t tuples = array.association == Association::points ? source.points.size() : source.types.size();
    array.values.resize(tuples * static_cast<std::size_t>(array.components), nan);
  }
  if (!source.left_out.empty()) source.left_out.resize(source.types.size(), 0);
}

void appendSet(vtkDataSet* data, Source& source) {
  const Base base{source.points.size(), source.types.size()};
  appendPoints(data, source);
  appendCells(data, source, base);
  markLeftOut(data, source, base);
  appendArrays(data->GetPointData(), Association::points, base.point, source.points.size() - base.point, source);
  appendArrays(data->GetCellData(), Association::cells, base.cell, source.types.size() - base.cell, source);
  fillArrays(source);
}

}  // namespace

void append(vtkDataObject* data, Source& source) {
  if (source.offsets.empty()) source.offsets.push_back(0);
  if (auto* set = vtkDataSet::SafeDownCast(data)) return appendSet(set, source);
  auto* composite = vtkCompositeDataSet::SafeDownCast(data);
  if (composite == nullptr) return;
  vtkSmartPointer<vtkCompositeDataIterator> leaf = vtk::TakeSmartPointer(composite->NewIterator());
  for (leaf->InitTraversal(); !leaf->IsDoneWithTraversal(); leaf->GoToNextItem()) {
    if (auto* set = vtkDataSet::SafeDownCast(leaf->GetCurrentDataObject())) appendSet(set, source);
  }
}

void append(const Source& part, Source& source) {
  if (source.offsets.empty()) source.offsets.push_back(0);
  const Base base{source.points.size(), source.types.size()};
  if (part.points.size() > max_points - base.point) {
    throw Error(fmt::format("'{}' has more than {} points; cut it into several files", source.name, max_points));
  }
  source.points.insert(source.points.end(), part.points.begin(), part.points.end());
  const std::size_t start = source.connectivity.size();
  source.connectivity.insert(source.connectivity.end(), part.connectivity.begin(), part.connectivity.end());
  source.types.insert(source.types.end(), part.types.begin(), part.types.end());
  for (std::size_t c = 0; c < part.types.size(); ++c) {
    source.offsets.push_back(start + part.offsets[c + 1]);
    std::uint32_t* ids = source.connectivity.data();
    forEachPoint(source, base.cell + c,
                 [&](const std::uint32_t& id) { ids[&id - ids] += static_cast<std::uint32_t>(base.point); });
    if (!part.left_out.empty() && part.left_out[c] != 0) leaveOut(base.cell + c, source);
  }
  for (const Array& array : part.arrays) {
    const std::size_t before = array.association == Association::points ? base.point : base.cell;
    Array& out = arrayOf(source, array.name, array.association, array.components, before);
    out.values.insert(out.values.end(), array.values.begin(), array.values.end());
    out.identifier |= array.identifier;
  }
  fillArrays(source);
}

}  // namespace spillikin::io
