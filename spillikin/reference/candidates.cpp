#include "spillikin/reference/candidates.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <memory>

#include "spillikin/base/error.h"

namespace spillikin::reference {
namespace {

// In the unit ball, with u = 2^-24: the float origin is off by at most u, the direction by u over a length of at most
// 2.1, a slab's plane minus the origin by 2.1 u, its product with the reciprocal direction by 3 u of 2.1 again, and the
// double-precision move of the origin by at most 2^-23 for an eye 2^30 radii away. 2^-19 = 32 u is more than their sum.
constexpr float box_margin = 1.0F / 524288.0F;
constexpr double farthest_eye = 1073741824.0;  // 2^30 radii

float roundDown(double value) {
  const auto rounded = static_cast<float>(value);
  return std::nextafter(rounded - box_margin, -std::numeric_limits<float>::infinity());
}

float roundUp(double value) {
  const auto rounded = static_cast<float>(value);
  return std::nextafter(rounded + box_margin, std::numeric_limits<float>::infinity());
}

struct Boxes {
  const mesh::Mesh* mesh;
  const std::vector<std::uint8_t>* hidden;
  Vec3 centre;
  double scale;
};

void setBounds(const RTCBoundsFunctionArguments* arguments) {
  const auto& boxes = *static_cast<const Boxes*>(arguments->geometryUserPtr);
  RTCBounds& out = *arguments->bounds_o;
  const mesh::Id cell = arguments->primID;
  if (!boxes.hidden->empty() && (*boxes.hidden)[cell] != 0) {  // an inverted box is no primitive
    out.lower_x = out.lower_y = out.lower_z = std::numeric_limits<float>::infinity();
    out.upper_x = out.upper_y = out.upper_z = -std::numeric_limits<float>::infinity();
    return;
  }
  Vec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
  for (const mesh::Id v : boxes.mesh->vertices(cell)) {
    lower = glm::min(lower, boxes.mesh->points[v]);
    upper = glm::max(upper, boxes.mesh->points[v]);
  }
  lower = (lower - boxes.centre) * boxes.scale;
  upper = (upper - boxes.centre) * boxes.scale;
  out.lower_x = roundDown(lower.x);
  out.lower_y = roundDown(lower.y);
  out.lower_z = roundDown(lower.z);
  out.upper_x = roundUp(upper.x);
  out.upper_y = roundUp(upper.y);
  out.upper_z = roundUp(upper.z);
}

// What travels with one ray through Embree.
struct Context {
  RTCIntersectContext embree;  // first, so that the callback can go back from it
  std::vector<mesh::Id>* cells;
};

// Takes note of the cell and lets the ray go on as far as before.
void note(const RTCOccludedFunctionNArguments* arguments) {
  if (arguments->valid[0] == 0) return;
  reinterpret_cast<Context*>(arguments->context)->cells->push_back(arguments->primID);
}

}  // namespace

struct Candidates::Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Boxes boxes{};
  ~Scene() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  void check(const mesh::Mesh& mesh) const {
    const RTCError error = rtcGetDeviceError(device);
    if (error != RTC_ERROR_NONE) {
      throw Error(fmt::format("{}: Embree cannot prepare {} cells (its error {}): free memory or use fewer cells",
                              mesh.name, mesh.cell_count(), static_cast<int>(error)));
    }
  }
};

Candidates::Candidates(const mesh::Mesh& mesh, const std::vector<std::uint8_t>& hidden) {
  Vec3 lower(std::numeric_limits<double>::infinity()), upper(-lower);
  for (const Vec3& p : mesh.points) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  if (mesh.points.empty()) lower = upper = Vec3(0.0);
  centre_ = 0.5 * lower + 0.5 * upper;
  const Vec3 half = 0.5 * upper - 0.5 * lower;
  radius_ = std::max(std::sqrt(half.x * half.x + half.y * half.y + half.z * half.z), 1e-300);
  for (int axis = 0; axis < 3; ++axis) {
    magnitude_ = std::max({magnitude_, std::abs(lower[axis]), std::abs(upper[axis])});
  }

  auto scene = std::make_unique<Scene>();
  scene->device = rtcNewDevice(nullptr);
  if (scene->device == nullptr) throw Error("Embree does not start on this machine: it needs SSE2");
  scene->boxes = {&mesh, &hidden, centre_, 1.0 / radius_};
  scene->scene = rtcNewScene(scene->device);
  rtcSetSceneFlags(scene->scene, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(mesh.cell_count()));
  rtcSetGeometryUserData(geometry, &scene->boxes);
  rtcSetGeometryBoundsFunction(geometry, setBounds, nullptr);
  rtcSetGeometryOccludedFunction(geometry, note);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene->scene);
  scene->check(mesh);
  scene_ = scene.release();
}

Candidates::~Candidates() {
  delete scene_;
}

void Candidates::gather(const Ray& ray, bool from_origin, std::vector<mesh::Id>& cells) const {
  cells.clear();
  const Vec3& d = ray.direction;
  const Vec3 direction = d / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  const Vec3 origin = (ray.origin - centre_) / radius_;
  const double along = -(origin.x * direction.x + origin.y * direction.y + origin.z * direction.z);
  if (!(std::abs(along) < farthest_eye)) {
    throw Error("eye is more than 1e9 mesh sizes away from the mesh: move it closer");
  }
  const Vec3 closest = origin + along * direction;
  constexpr double reach = 1.00001;  // of the ball, rounding included
  if (closest.x * closest.x + closest.y * closest.y + closest.z * closest.z > reach * reach) return;
  double start = -reach;
  if (from_origin) start = std::max(start, -along - static_cast<double>(box_margin));
  if (start > reach) return;

  const Vec3 from = closest + start * direction;
  RTCRay query{};
  query.org_x = static_cast<float>(from.x);
  query.org_y = static_cast<float>(from.y);
  query.org_z = static_cast<float>(from.z);
  query.dir_x = static_cast<float>(direction.x);
  query.dir_y = static_cast<float>(direction.y);
  query.dir_z = static_cast<float>(direction.z);
  query.tnear = 0.0F;
  query.tfar = static_cast<float>(2.0 * reach + 0.001);
  query.mask = ~0U;
  Context context;
  rtcInitIntersectContext(&context.embree);
  context.cells = &cells;
  rtcOccluded1(scene_->scene, &context.embree, &query);
}

}  // namespace spillikin::reference
