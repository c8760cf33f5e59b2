#include "io_samples.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <vtk_cgns.h>
#include <vtk_exodusII.h>
// The two libraries define these for themselves.
#include VTK_CGNS(cgnslib.h)

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace spillikin::tests {
namespace {

constexpr const char* coordinates = "0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0 0 0 1 1 0 1 2 0 1 0 1 1 1 1 1 2 1 1";
constexpr const char* values = "0 1 2 10 11 12 100 101 102 110 111 112";
constexpr std::array<int, 16> corners = {0, 1, 4, 3, 6, 7, 10, 9, 1, 2, 5, 4, 7, 8, 11, 10};
constexpr const char* corner_text = "0 1 4 3 6 7 10 9 1 2 5 4 7 8 11 10";

std::array<float, 36> xyz() {
  std::array<float, 36> out{};
  for (std::size_t p = 0; p < 12; ++p) {
    out[3 * p] = static_cast<float>(p % 3);
    out[3 * p + 1] = static_cast<float>(p / 3 % 2);
    out[3 * p + 2] = static_cast<float>(p / 6);
  }
  return out;
}

std::array<float, 12> scalar() {
  const auto at = xyz();
  std::array<float, 12> out{};
  for (std::size_t p = 0; p < 12; ++p)
    out[p] = at[3 * p] + 10.0F * at[3 * p + 1] + 100.0F * at[3 * p + 2];
  return out;
}

// ---- Legacy ---------------------------------------------------------------------------------------------------------

std::string legacy(const char* body, const char* format = "ASCII") {
  return fmt::format("# vtk DataFile Version 3.0\nbox\n{}\n{}", format, body);
}

std::string legacyData() {
  return fmt::format(
      "POINT_DATA 12\nSCALARS p float 1\nLOOKUP_TABLE default\n{}\n"
      "CELL_DATA 2\nSCALARS c float 1\nLOOKUP_TABLE default\n5 6\n",
      values);
}

void legacyUnstructured(const TempFolder& folder) {
  const std::string cells = "CELLS 2 18\n8 0 1 4 3 6 7 10 9\n8 1 2 5 4 7 8 11 10\nCELL_TYPES 2\n12 12\n";
  const std::string body =
      fmt::format("DATASET UNSTRUCTURED_GRID\nPOINTS 12 float\n{}\n{}{}", coordinates, cells, legacyData());
  writeText(folder / "unstructured.vtk", legacy(body.c_str()));
}

template <typename T>
std::string bigEndian(const T* data, std::size_t count) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), data + i, sizeof(T));
    out.append(bytes.rbegin(), bytes.rend());
  }
  return out;
}

void legacyBinary(const TempFolder& folder) {
  const auto points = xyz();
  const auto p = scalar();
  std::vector<std::int32_t> cells;
  for (std::size_t k = 0; k < 16; ++k) {
    if (k % 8 == 0) cells.push_back(8);
    cells.push_back(corners[k]);
  }
  const std::array<std::int32_t, 2> types = {12, 12};
  const std::array<float, 2> c = {5, 6};
  std::string body = "DATASET UNSTRUCTURED_GRID\nPOINTS 12 float\n" + bigEndian(points.data(), 36);
  body += "\nCELLS 2 18\n" + bigEndian(cells.data(), cells.size());
  body += "\nCELL_TYPES 2\n" + bigEndian(types.data(), 2);
  body += "\nPOINT_DATA 12\nSCALARS p float 1\nLOOKUP_TABLE default\n" + bigEndian(p.data(), 12);
  body += "\nCELL_DATA 2\nSCALARS c float 1\nLOOKUP_TABLE default\n" + bigEndian(c.data(), 2) + "\n";
  writeText(folder / "binary.vtk", "# vtk DataFile Version 3.0\nbox\nBINARY\n" + body);
}

void legacyStructured(const TempFolder& folder) {
  const std::string body =
      fmt::format("DATASET STRUCTURED_GRID\nDIMENSIONS 3 2 2\nPOINTS 12 float\n{}\n{}", coordinates, legacyData());
  writeText(folder / "structured.vtk", legacy(body.c_str()));
}

void legacyRectilinear(const TempFolder& folder) {
  const std::string body = fmt::format(
      "DATASET RECTILINEAR_GRID\nDIMENSIONS 3 2 2\nX_COORDINATES 3 float\n0 1 2\nY_COORDINATES 2 float\n"
      "0 1\nZ_COORDINATES 2 float\n0 1\n{}",
      legacyData());
  writeText(folder / "rectilinear.vtk", legacy(body.c_str()));
}

void legacyImage(const TempFolder& folder) {
  const std::string body =
      fmt::format("DATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n{}", legacyData());
  writeText(folder / "image.vtk", legacy(body.c_str()));
}

// ---- VTK's XML ------------------------------------------------------------------------------------------------------

std::string array(const char* type, const char* name, int components, const std::string& text) {
  return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"ascii\">{}</DataArray>\n",
                     type, name, components, text);
}

std::string xml(const char* type, const std::string& body) {
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"{}\" version=\"1.0\" byte_order=\"LittleEndian\">\n{}</VTKFile>\n",
      type, body);
}

std::string boxData() {
  return "<PointData Scalars=\"p\">\n" + array("Float32", "p", 1, values) + "</PointData>\n<CellData Scalars=\"c\">\n" +
         array("Float64", "c", 1, "5 6") + "</CellData>\n";
}

void xmlUnstructured(const TempFolder& folder) {
  writeText(folder / "box.vtu", vtu(12, 2, coordinates, corner_text, "8 16", "12 12", boxData()));
}

// Arrays raw behind the XML, each with its size in front.
void xmlAppended(const TempFolder& folder) {
  std::string raw;
  const auto append = [&](const char* type, const char* name, int components, const void* data, std::size_t bytes) {
    const std::string element = fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n", type,
        name, components, raw.size());
    const auto size = static_cast<std::uint32_t>(bytes);
    raw.append(reinterpret_cast<const char*>(&size), sizeof size);
    raw.append(static_cast<const char*>(data), bytes);
    return element;
  };
  const auto points = xyz();
  const auto p = scalar();
  const std::array<float, 2> c = {5, 6};
  const std::array<std::int32_t, 2> offsets = {8, 16};
  const std::array<std::uint8_t, 2> types = {12, 12};
  std::string body = "<UnstructuredGrid><Piece NumberOfPoints=\"12\" NumberOfCells=\"2\">\n<PointData>";
  body += append("Float32", "p", 1, p.data(), sizeof p) + "</PointData><CellData>";
  body += append("Float32", "c", 1, c.data(), sizeof c) + "</CellData><Points>";
  body += append("Float32", "Points", 3, points.data(), sizeof points) + "</Points><Cells>";
  body += append("Int32", "connectivity", 1, corners.data(), sizeof corners);
  body += append("Int32", "offsets", 1, offsets.data(), sizeof offsets);
  body += append("UInt8", "types", 1, types.data(), sizeof types) + "</Cells></Piece></UnstructuredGrid>\n";
  body += "<AppendedData encoding=\"raw\">_" + raw + "</AppendedData>\n";
  writeText(folder / "appended.vtu", xml("UnstructuredGrid", body));
}

// The hexahedron at x = i .. i + 1, alone.
std::string halfVtu(int i) {
  std::string points, p;
  for (int k = 0; k < 8; ++k) {
    const int x = i + k % 2, y = k / 2 % 2, z = k / 4;
    points += fmt::format("{} {} {} ", x, y, z);
    p += fmt::format("{} ", x + 10 * y + 100 * z);
  }
  const std::string data = "<PointData>\n" + array("Float32", "p", 1, p) + "</PointData><CellData>\n" +
                           array("Float64", "c", 1, fmt::format("{}", 5 + i)) + "</CellData>\n";
  return vtu(8, 1, points, "0 1 3 2 4 5 7 6", "8", "12", data);
}

void halves(const TempFolder& folder) {
  writeText(folder / "half0.vtu", halfVtu(0));
  writeText(folder / "half1.vtu", halfVtu(1));
}

void xmlParallel(const TempFolder& folder) {
  halves(folder);
  writeText(folder / "box.pvtu",
            xml("PUnstructuredGrid",
                "<PUnstructuredGrid GhostLevel=\"0\"><PPointData><PDataArray type=\"Float32\" Name=\"p\"/></PPointData>"
                "<PCellData><PDataArray type=\"Float64\" Name=\"c\"/></PCellData>"
                "<PPoints><PDataArray type=\"Float32\" NumberOfComponents=\"3\"/></PPoints>"
                "<Piece Source=\"half0.vtu\"/><Piece Source=\"half1.vtu\"/></PUnstructuredGrid>\n"));
}

void xmlBlocks(const TempFolder& folder) {
  halves(folder);
  writeText(folder / "box.vtm", xml("vtkMultiBlockDataSet",
                                    "<vtkMultiBlockDataSet><DataSet index=\"0\" file=\"half0.vtu\"/>"
                                    "<Block index=\"1\"><DataSet index=\"0\" file=\"half1.vtu\"/></Block>"
                                    "</vtkMultiBlockDataSet>\n"));
}

// Step k at time k / 2; listed in another order than that of their times.
void collection(const TempFolder& folder) {
  halves(folder);
  writeText(folder / "box.pvd", xml("Collection",
                                    "<Collection><DataSet timestep=\"0.5\" part=\"0\" file=\"half1.vtu\"/>"
                                    "<DataSet timestep=\"0\" part=\"0\" file=\"half0.vtu\"/>"
                                    "<DataSet timestep=\"0\" part=\"1\" file=\"half1.vtu\"/></Collection>\n"));
}

std::string structuredXml(const char* type, const std::string& attributes, const std::string& body,
                          const std::string& extent = "0 2 0 1 0 1") {
  return xml(type, fmt::format("<{0} WholeExtent=\"{3}\" {1}><Piece Extent=\"{3}\">\n{2}</Piece></{0}>\n", type,
                               attributes, body, extent));
}

void xmlStructured(const TempFolder& folder) {
  const std::string points = "<Points>" + array("Float32", "Points", 3, coordinates) + "</Points>";
  writeText(folder / "box.vts", structuredXml("StructuredGrid", "", boxData() + points));
}

void xmlRectilinear(const TempFolder& folder) {
  const std::string axes = "<Coordinates>" + array("Float32", "x", 1, "0 1 2") + array("Float32", "y", 1, "0 1") +
                           array("Float32", "z", 1, "0 1") + "</Coordinates>";
  writeText(folder / "box.vtr", structuredXml("RectilinearGrid", "", boxData() + axes));
}

void xmlImage(const TempFolder& folder) {
  writeText(folder / "box.vti", structuredXml("ImageData", "Origin=\"0 0 0\" Spacing=\"1 1 1\"", boxData()));
}

void xmlParallelImage(const TempFolder& folder) {
  for (int i = 0; i < 2; ++i) {
    std::string p;
    for (int k = 0; k < 8; ++k)
      p += fmt::format("{} ", i + k % 2 + 10 * (k / 2 % 2) + 100 * (k / 4));
    const std::string data = "<PointData>\n" + array("Float32", "p", 1, p) + "</PointData><CellData>\n" +
                             array("Float64", "c", 1, fmt::format("{}", 5 + i)) + "</CellData>\n";
    writeText(folder / fmt::format("half{}.vti", i), structuredXml("ImageData", "Origin=\"0 0 0\" Spacing=\"1 1 1\"",
                                                                   data, fmt::format("{} {} 0 1 0 1", i, i + 1)));
  }
  writeText(folder / "box.pvti",
            xml("PImageData",
                "<PImageData WholeExtent=\"0 2 0 1 0 1\" GhostLevel=\"0\" Origin=\"0 0 0\" Spacing=\"1 1 1\">"
                "<PPointData><PDataArray type=\"Float32\" Name=\"p\"/></PPointData>"
                "<PCellData><PDataArray type=\"Float64\" Name=\"c\"/></PCellData>"
                "<Piece Extent=\"0 1 0 1 0 1\" Source=\"half0.vti\"/>"
                "<Piece Extent=\"1 2 0 1 0 1\" Source=\"half1.vti\"/></PImageData>\n"));
}

// ---- Exodus II ------------------------------------------------------------------------------------------------------

void require(bool good, const char* what) {
  if (!good) throw std::runtime_error(what);
}

// Two blocks of one hexahedron; two steps, whose values differ by the time; displacements that must not be applied.
void exodus(const TempFolder& folder) {
  int computer = sizeof(double), stored = sizeof(double);
  const int file = ex_create((folder / "box.exo").c_str(), EX_CLOBBER, &computer, &stored);
  require(file >= 0, "ex_create");
  const auto at = xyz();
  std::array<double, 12> x{}, y{}, z{};
  for (std::size_t p = 0; p < 12; ++p) {
    x[p] = static_cast<double>(at[3 * p]), y[p] = static_cast<double>(at[3 * p + 1]);
    z[p] = static_cast<double>(at[3 * p + 2]);
  }
  ex_put_init(file, "box", 3, 12, 2, 2, 0, 0);
  ex_put_coord(file, x.data(), y.data(), z.data());
  for (int block = 0; block < 2; ++block) {
    std::array<int, 8> ids{};
    for (std::size_t k = 0; k < 8; ++k)
      ids[k] = corners[8 * static_cast<std::size_t>(block) + k] + 1;
    ex_put_block(file, EX_ELEM_BLOCK, 10 + block, "HEX8", 1, 8, 0, 0, 0);
    ex_put_conn(file, EX_ELEM_BLOCK, 10 + block, ids.data(), nullptr, nullptr);
  }
  std::array<std::string, 4> nodal = {"p", "DISPLX", "DISPLY", "DISPLZ"};
  std::array<char*, 4> names{};
  for (std::size_t i = 0; i < 4; ++i)
    names[i] = nodal[i].data();
  std::string element = "c";
  std::array<char*, 1> element_names = {element.data()};
  ex_put_variable_param(file, EX_NODAL, 4);
  ex_put_variable_names(file, EX_NODAL, 4, names.data());
  ex_put_variable_param(file, EX_ELEM_BLOCK, 1);
  ex_put_variable_names(file, EX_ELEM_BLOCK, 1, element_names.data());
  for (int step = 0; step < 2; ++step) {
    const double time = 0.5 * step;
    ex_put_time(file, step + 1, &time);
    std::array<double, 12> p{}, moved{};
    for (std::size_t i = 0; i < 12; ++i)
      p[i] = static_cast<double>(scalar()[i]) + time;
    moved.fill(1.0 + time);
    ex_put_var(file, step + 1, EX_NODAL, 1, 1, 12, p.data());
    for (int d = 2; d <= 4; ++d)
      ex_put_var(file, step + 1, EX_NODAL, d, 1, 12, moved.data());
    for (int block = 0; block < 2; ++block) {
      const double c = 5.0 + block;
      ex_put_var(file, step + 1, EX_ELEM_BLOCK, 1, 10 + block, 1, &c);
    }
  }
  require(ex_close(file) >= 0, "ex_close");
}

// ---- CGNS -----------------------------------------------------------------------------------------------------------

void cgns(const TempFolder& folder) {
  int file = 0, base = 0, zone = 0, coordinate = 0, section = 0, solution = 0, field = 0;
  const auto good = [](int status) { require(status == CG_OK, cg_get_error()); };
  good(cg_open((folder / "box.cgns").c_str(), CG_MODE_WRITE, &file));
  good(cg_base_write(file, "Base", 3, 3, &base));
  std::array<cgsize_t, 3> size = {12, 2, 0};
  good(cg_zone_write(file, base, "Zone", size.data(), CGNS_ENUMV(Unstructured), &zone));
  const auto at = xyz();
  for (std::size_t d = 0; d < 3; ++d) {
    constexpr std::array names = {"CoordinateX", "CoordinateY", "CoordinateZ"};
    std::array<float, 12> axis{};
    for (std::size_t p = 0; p < 12; ++p)
      axis[p] = at[3 * p + d];
    good(cg_coord_write(file, base, zone, CGNS_ENUMV(RealSingle), names[d], axis.data(), &coordinate));
  }
  std::array<cgsize_t, 16> ids{};
  for (std::size_t k = 0; k < 16; ++k)
    ids[k] = corners[k] + 1;
  good(cg_section_write(file, base, zone, "Elements", CGNS_ENUMV(HEXA_8), 1, 2, 0, ids.data(), &section));
  good(cg_sol_write(file, base, zone, "PointSolution", CGNS_ENUMV(Vertex), &solution));
  good(cg_field_write(file, base, zone, solution, CGNS_ENUMV(RealSingle), "p", scalar().data(), &field));
  const std::array<float, 2> c = {5, 6};
  good(cg_sol_write(file, base, zone, "CellSolution", CGNS_ENUMV(CellCenter), &solution));
  good(cg_field_write(file, base, zone, solution, CGNS_ENUMV(RealSingle), "c", c.data(), &field));
  good(cg_close(file));
}

// ---- EnSight Gold, ASCII: two parts of one hexahedron, two steps ----------------------------------------------------

void ensight(const TempFolder& folder) {
  writeText(folder / "box.case",
            "FORMAT\ntype: ensight gold\n\nGEOMETRY\nmodel: box.geo\n\nVARIABLE\n"
            "scalar per node: 1 p box.p**\nscalar per element: 1 c box.c**\n\n"
            "TIME\ntime set: 1\nnumber of steps: 2\nfilename start number: 0\nfilename increment: 1\n"
            "time values: 0.0 0.5\n");
  std::string geometry = "box\nby hand\nnode id off\nelement id off\n";
  std::array<std::string, 2> p, c;
  for (std::size_t step = 0; step < 2; ++step)
    p[step] = "p\n", c[step] = "c\n";
  for (int i = 0; i < 2; ++i) {
    geometry += fmt::format("part\n{:10d}\nhalf\ncoordinates\n{:10d}\n", i + 1, 8);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 8; ++k) {
        const std::array<int, 3> at = {i + k % 2, k / 2 % 2, k / 4};
        geometry += fmt::format("{:12.5e}\n", static_cast<double>(at[static_cast<std::size_t>(axis)]));
      }
    }
    geometry += fmt::format("hexa8\n{:10d}\n", 1);
    for (const int k : {1, 2, 4, 3, 5, 6, 8, 7})
      geometry += fmt::format("{:10d}", k);
    geometry += "\n";
    for (std::size_t step = 0; step < 2; ++step) {
      p[step] += fmt::format("part\n{:10d}\ncoordinates\n", i + 1);
      for (int k = 0; k < 8; ++k) {
        const double value = i + k % 2 + 10 * (k / 2 % 2) + 100 * (k / 4) + 0.5 * static_cast<double>(step);
        p[step] += fmt::format("{:12.5e}\n", value);
      }
      c[step] += fmt::format("part\n{:10d}\nhexa8\n{:12.5e}\n", i + 1, 5.0 + i);
    }
  }
  writeText(folder / "box.geo", geometry);
  for (std::size_t step = 0; step < 2; ++step) {
    writeText(folder / fmt::format("box.p{:02d}", step), p[step]);
    writeText(folder / fmt::format("box.c{:02d}", step), c[step]);
  }
}

// ---- OpenFOAM -------------------------------------------------------------------------------------------------------

std::string foam(const char* kind, const char* object, const std::string& body) {
  return fmt::format("FoamFile\n{{\n    version 2.0;\n    format ascii;\n    class {};\n    object {};\n}}\n{}\n", kind,
                     object, body);
}

void openFoam(const TempFolder& folder) {
  namespace fs = std::filesystem;
  for (const char* name : {"constant/polyMesh", "system", "0", "0.5"})
    fs::create_directories(folder.path() / name);
  writeText(folder / "box.foam", "");
  writeText(folder / "system/controlDict",
            foam("dictionary", "controlDict",
                 "application none;\nstartFrom startTime;\nstartTime 0;\nstopAt endTime;\nendTime 0.5;\ndeltaT 0.5;\n"
                 "writeControl timeStep;\nwriteInterval 1;\n"));
  std::string points = "12\n(\n";
  const auto at = xyz();
  for (std::size_t p = 0; p < 12; ++p)
    points += fmt::format("({} {} {})\n", at[3 * p], at[3 * p + 1], at[3 * p + 2]);
  writeText(folder / "constant/polyMesh/points", foam("vectorField", "points", points + ")\n"));
  // The face between the two cells first, then the ten outside.
  writeText(folder / "constant/polyMesh/faces",
            foam("faceList", "faces",
                 "11\n(\n4(1 4 10 7)\n4(0 6 9 3)\n4(0 1 7 6)\n4(3 9 10 4)\n4(0 3 4 1)\n4(6 7 10 9)\n"
                 "4(2 5 11 8)\n4(1 2 8 7)\n4(4 10 11 5)\n4(1 4 5 2)\n4(7 8 11 10)\n)\n"));
  writeText(folder / "constant/polyMesh/owner",
            foam("labelList", "owner", "11\n(\n0\n0\n0\n0\n0\n0\n1\n1\n1\n1\n1\n)\n"));
  writeText(folder / "constant/polyMesh/neighbour", foam("labelList", "neighbour", "1\n(\n1\n)\n"));
  writeText(folder / "constant/polyMesh/boundary",
            foam("polyBoundaryMesh", "boundary", "1\n(\n walls\n {\n type wall;\n nFaces 10;\n startFace 1;\n }\n)\n"));
  for (const char* time : {"0", "0.5"}) {
    writeText(folder / (std::string(time) + "/c"),
              foam("volScalarField", "c",
                   "dimensions [0 0 0 0 0 0 0];\ninternalField nonuniform List<scalar>\n2\n(\n5\n6\n)\n;\n"
                   "boundaryField\n{\n walls\n {\n type zeroGradient;\n }\n}\n"));
  }
}

// ---- PLOT3D: one grid, big-endian floats without byte counts --------------------------------------------------------

void plot3d(const TempFolder& folder) {
  const std::array<std::int32_t, 3> dims = {3, 2, 2};
  const auto at = xyz();
  std::array<float, 36> axes{};
  for (std::size_t p = 0; p < 12; ++p) {
    for (std::size_t d = 0; d < 3; ++d)
      axes[12 * d + p] = at[3 * p + d];
  }
  writeText(folder / "boxxyz.bin", bigEndian(dims.data(), 3) + bigEndian(axes.data(), 36));
  const std::array<float, 4> conditions = {0.5F, 0.0F, 1.0F, 0.0F};
  std::array<float, 60> q{};
  for (std::size_t p = 0; p < 12; ++p) {
    q[p] = scalar()[p] + 1.0F;
    q[48 + p] = 10.0F;
  }
  writeText(folder / "boxq.bin", bigEndian(dims.data(), 3) + bigEndian(conditions.data(), 4) + bigEndian(q.data(), 60));
}

}  // namespace

TempFolder::TempFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "spillikin-io-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
  path_ = name;
}

TempFolder::~TempFolder() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

void writeText(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.flush();
  if (!out) throw std::runtime_error("cannot write " + path);
}

std::string readText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::string vtu(std::size_t points, std::size_t cells, const std::string& coordinate_text,
                const std::string& connectivity, const std::string& offsets, const std::string& types,
                const std::string& more) {
  std::string body =
      fmt::format("<UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", points, cells);
  body += more + "<Points>\n" + array("Float64", "Points", 3, coordinate_text) + "</Points>\n<Cells>\n";
  body += array("Int64", "connectivity", 1, connectivity) + array("Int64", "offsets", 1, offsets);
  // A face stream comes with the elements of `types`.
  const std::size_t bar = types.find('|');
  body += array("UInt8", "types", 1, types.substr(0, bar));
  if (bar != std::string::npos) {
    const std::size_t second = types.find('|', bar + 1);
    body += array("Int64", "faces", 1, types.substr(bar + 1, second - bar - 1));
    body += array("Int64", "faceoffsets", 1, types.substr(second + 1));
  }
  return xml("UnstructuredGrid", body + "</Cells>\n</Piece></UnstructuredGrid>\n");
}

const std::vector<Sample>& samples() {
  static const std::vector<Sample> all = {
      {"unstructured.vtk", legacyUnstructured, {"unstructured.vtk"}},
      {"binary.vtk", legacyBinary, {"binary.vtk"}},
      {"structured.vtk", legacyStructured, {"structured.vtk"}},
      {"rectilinear.vtk", legacyRectilinear, {"rectilinear.vtk"}},
      {"image.vtk", legacyImage, {"image.vtk"}},
      {"box.vtu", xmlUnstructured, {"box.vtu"}},
      {"appended.vtu", xmlAppended, {"appended.vtu"}},
      {"box.pvtu", xmlParallel, {"box.pvtu", "half0.vtu", "half1.vtu"}},
      {"box.vtm", xmlBlocks, {"box.vtm", "half0.vtu", "half1.vtu"}},
      {"box.pvd", collection, {"box.pvd", "half0.vtu", "half1.vtu"}, 2},
      {"box.vts", xmlStructured, {"box.vts"}},
      {"box.vtr", xmlRectilinear, {"box.vtr"}},
      {"box.vti", xmlImage, {"box.vti"}},
      {"box.pvti", xmlParallelImage, {"box.pvti", "half0.vti", "half1.vti"}},
      {"box.exo", exodus, {"box.exo"}, 2},
      {"box.cgns", cgns, {"box.cgns"}},
      {"box.case", ensight, {"box.case", "box.geo", "box.p00", "box.c00"}, 2},
      {"box.foam",
       openFoam,
       {"constant/polyMesh/points", "constant/polyMesh/faces", "constant/polyMesh/owner", "0/c", "system/controlDict"},
       2},
      {"boxxyz.bin", plot3d, {"boxxyz.bin", "boxq.bin"}, 1, false},
  };
  return all;
}

const Sample& sample(const std::string& name) {
  for (const Sample& one : samples()) {
    if (one.name == name) return one;
  }
  throw std::runtime_error("no sample " + name);
}

}  // namespace spillikin::tests
