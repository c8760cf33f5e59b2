#include "spillikin/render/defaults.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

namespace spillikin::render {

namespace {

constexpr double radians(double degrees) {
  return degrees * std::numbers::pi / 180.0;
}

double boundingRadius(const Box& box) {
  const double radius = 0.5 * glm::length(box.upper - box.lower);
  return radius > 0.0 ? radius : 1.0;  // a mesh of one place still gets a view
}

// Rodrigues' rotation of v about a unit axis.
Vec3 rotated(const Vec3& v, const Vec3& axis, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return v * c + glm::cross(axis, v) * s + axis * (glm::dot(axis, v) * (1.0 - c));
}

struct Lump {
  Vec3 middle{0.0};
  double depth = 0.0;  // extinction times volume
};

std::vector<Lump> lumps(const mesh::Mesh& mesh, const mesh::Field& field, const integrate::TransferFunction& look) {
  std::vector<Lump> all;
  all.reserve(mesh.cell_count());
  mesh::Surface surface;
  for (mesh::Id c = 0; c < mesh.cell_count(); ++c) {
    if (!field.hidden.empty() && field.hidden[c] != 0) continue;
    mesh::surface(mesh, c, surface);
    if (surface.triangles.empty()) continue;
    const auto vertices = mesh.vertices(c);
    Lump lump;
    double extinction = 0.0;
    for (const mesh::Id v : vertices) {
      lump.middle += mesh.points[v];
      if (field.association == mesh::Association::points) extinction += look(field.values[v]).extinction;
    }
    const double n = static_cast<double>(vertices.size());
    lump.middle /= n;
    extinction = field.association == mesh::Association::cells ? look(field.values[c]).extinction : extinction / n;
    lump.depth = extinction * std::abs(mesh::enclosedVolume(mesh.points, surface));
    all.push_back(lump);
  }
  return all;
}

// Optical depths of the columns along one axis that hold any lump.
void columnDepths(const std::vector<Lump>& all, const Box& box, int axis, int n, std::vector<double>& depths) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const Vec3 extent = box.upper - box.lower;
  if (!(extent[u] > 0.0) || !(extent[v] > 0.0)) return;
  std::vector<double> column(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), 0.0);
  for (const Lump& lump : all) {
    const auto cell = [&](int k) {
      return std::clamp(static_cast<int>(n * (lump.middle[k] - box.lower[k]) / extent[k]), 0, n - 1);
    };
    column[static_cast<std::size_t>(cell(u)) * static_cast<std::size_t>(n) + static_cast<std::size_t>(cell(v))] +=
        lump.depth;
  }
  const double area = extent[u] * extent[v] / (static_cast<double>(n) * n);
  for (const double d : column) {
    if (d > 0.0) depths.push_back(d / area);
  }
}

}  // namespace

Box boundingBox(const mesh::Mesh& mesh) {
  if (mesh.points.empty()) return {};
  Box box{mesh.points.front(), mesh.points.front()};
  for (const Vec3& p : mesh.points) {
    box.lower = glm::min(box.lower, p);
    box.upper = glm::max(box.upper, p);
  }
  return box;
}

double fittingParallelScale(const Box& box, int width, int height) {
  const double aspect = static_cast<double>(width) / height;
  return boundingRadius(box) / std::min(1.0, aspect);
}

void placeEye(View& view, const Box& box, const Turn& turn) {
  double angle = radians(view.view_angle);
  const double aspect = static_cast<double>(view.width) / view.height;
  if (aspect < 1.0) angle = 2.0 * std::atan(std::tan(0.5 * angle) * aspect);
  const double distance = boundingRadius(box) / std::sin(0.5 * angle);
  view.target = 0.5 * (box.lower + box.upper);
  view.eye = view.target + Vec3(0.0, 0.0, distance);
  view.up = Vec3(0.0, 1.0, 0.0);
  turnView(view, turn);
}

void turnView(View& view, const Turn& turn) {
  Vec3 arm = view.eye - view.target;
  const double up_length = glm::length(view.up);
  if (turn.azimuth != 0.0 && up_length > 0.0) arm = rotated(arm, view.up / up_length, radians(turn.azimuth));
  const Vec3 right = glm::cross(view.up, arm);  // the image's right, as seen by the viewer
  if (turn.elevation != 0.0 && glm::length(right) > 0.0) {
    const Vec3 axis = glm::normalize(right);
    arm = rotated(arm, axis, -radians(turn.elevation));
    // Up turns along, so that an elevation of 90 degrees is a view like any other.
    view.up = rotated(view.up, axis, -radians(turn.elevation));
  }
  view.eye = view.target + arm;
  if (view.parallel()) {
    view.parallel_scale /= turn.zoom;
  } else {
    view.view_angle /= turn.zoom;
  }
}

double extinctionFactor(const mesh::Mesh& mesh, const mesh::Field& field, const integrate::TransferFunction& look,
                        double transmittance) {
  const std::vector<Lump> all = lumps(mesh, field, look);
  const Box box = boundingBox(mesh);
  // Columns wide enough to hold the middles of several cells each, so that none is empty by chance.
  const int n = std::clamp(static_cast<int>(0.5 * std::cbrt(static_cast<double>(all.size()))), 1, 64);
  std::vector<double> depths;
  for (int axis = 0; axis < 3; ++axis)
    columnDepths(all, box, axis, n, depths);
  if (depths.empty()) return 1.0;
  const auto median = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), median, depths.end());
  return -std::log(transmittance) / *median;
}

integrate::TransferFunction typicalLook(const mesh::Mesh& mesh, const mesh::Field& field, const char* preset) {
  const auto look = integrate::preset(preset).mapped(field.lo, field.hi);
  return look.scaled(extinctionFactor(mesh, field, look));
}

}  // namespace spillikin::render
