// Frames for the compositors' tests, and a plain ray caster to judge them by: every triangle of every cell against
// every pixel, in double precision.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "spillikin/composite/compositor.h"
#include "spillikin/integrate/segment.h"
#include "spillikin/mesh/build.h"
#include "spillikin/mesh/field.h"
#include "spillikin/sort/sort.h"

namespace spillikin::tests {

// A mesh, a field on it and a transfer function over the field's range.
struct Subject {
  mesh::Mesh mesh;
  mesh::Field field;
  integrate::TransferFunction tf;

  Subject(const mesh::Source& source, const std::string& array, const char* look, double extinction)
      : mesh(mesh::build(source)), field(mesh::selectField(source, mesh, array)) {
    tf = integrate::preset(look).scaled(extinction).mapped(field.lo, field.hi);
  }
};

struct RaySpan {
  double near, far, front, back;
};

// The intervals of one cell on a line, by solving for each boundary triangle.
inline void cellSpans(const Subject& s, mesh::Id cell, const Vec3& origin, const Vec3& direction,
                      mesh::Surface& surface, std::vector<RaySpan>& out) {
  struct Hit {
    double w, value;
    bool leaves;
  };
  std::vector<Hit> hits;
  mesh::surface(s.mesh, cell, surface);
  const bool of_cells = s.field.association == mesh::Association::cells;
  for (const auto& t : surface.triangles) {
    const Vec3 a = s.mesh.points[t[0]];
    const Vec3 e1 = s.mesh.points[t[1]] - a;
    const Vec3 e2 = s.mesh.points[t[2]] - a;
    const Vec3 p = glm::cross(direction, e2);
    const double det = glm::dot(e1, p);
    if (det == 0.0) continue;
    const Vec3 q = origin - a;
    const double u = glm::dot(q, p) / det;
    const Vec3 r = glm::cross(q, e1);
    const double v = glm::dot(direction, r) / det;
    if (u < 0.0 || v < 0.0 || u + v > 1.0) continue;
    const auto value = [&](int k) { return of_cells ? s.field.values[cell] : s.field.values[t[k]]; };
    hits.push_back({glm::dot(e2, r) / det, value(0) + u * (value(1) - value(0)) + v * (value(2) - value(0)),
                    glm::dot(glm::cross(e1, e2), direction) > 0.0});
  }
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.w < b.w; });
  for (std::size_t i = 0; i + 1 < hits.size(); ++i) {
    if (!hits[i].leaves && hits[i + 1].leaves)
      out.push_back({hits[i].w, hits[i + 1].w, hits[i].value, hits[i + 1].value});
  }
}

inline void trimSpan(RaySpan& s, double at, double slope) {
  const double w = -at / slope;
  const double value = s.front + (s.back - s.front) * (s.far > s.near ? (w - s.near) / (s.far - s.near) : 0.0);
  if (slope > 0.0 && w > s.near) s = {w, s.far, value, s.back};
  if (slope < 0.0 && w < s.far) s = {s.near, w, s.front, value};
}

// Every cell on the ray of a pixel centre, near to far.
inline std::vector<RaySpan> raySpans(const Subject& s, const project::Camera& camera, double x, double y) {
  std::vector<RaySpan> spans;
  mesh::Surface surface;
  const Vec3 origin = camera.origin(x, y);
  const Vec3 direction = camera.direction(x, y);
  for (mesh::Id c = 0; c < s.mesh.cell_count(); ++c) {
    if (!s.field.hidden.empty() && s.field.hidden[c] != 0) continue;
    cellSpans(s, c, origin, direction, surface, spans);
  }
  for (RaySpan& span : spans) {
    if (!camera.parallel()) trimSpan(span, 0.0, 1.0);
    for (const ClipPlane& clip : camera.view().clips) {
      trimSpan(span, glm::dot(clip.normal, origin - clip.point), glm::dot(clip.normal, direction));
    }
  }
  std::erase_if(spans, [](const RaySpan& span) { return !(span.far > span.near); });
  std::sort(spans.begin(), spans.end(), [](const RaySpan& a, const RaySpan& b) { return a.near < b.near; });
  return spans;
}

inline Image castRays(const Subject& s, const project::Camera& camera) {
  Image image(camera.width(), camera.height());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double scale = glm::length(camera.direction(x + 0.5, y + 0.5));
      integrate::Radiance sum;
      for (const RaySpan& span : raySpans(s, camera, x + 0.5, y + 0.5)) {
        sum = integrate::over(sum, integrate::integrate(s.tf, span.front, span.back, (span.far - span.near) * scale));
      }
      float* out = image.pixel(x, y);
      for (std::size_t k = 0; k < 3; ++k)
        out[k] = static_cast<float>(sum.color[k]);
      out[3] = static_cast<float>(sum.alpha);
    }
  }
  return image;
}

inline double largestDifference(const Image& a, const Image& b) {
  if (a.rgba.size() != b.rgba.size()) return std::numeric_limits<double>::infinity();
  double worst = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    const double d = std::abs(double(a.rgba[i]) - double(b.rgba[i]));
    if (!(d <= worst)) worst = d;  // a NaN counts
  }
  return worst;
}

inline View viewOf(const Subject& s, Vec3 from, int width, int height, double distance = 2.5) {
  Vec3 lo(std::numeric_limits<double>::infinity());
  Vec3 hi = -lo;
  for (const Vec3& p : s.mesh.points) {
    lo = glm::min(lo, p);
    hi = glm::max(hi, p);
  }
  View view;
  view.target = 0.5 * (lo + hi);
  view.eye = view.target + distance * glm::length(hi - lo) * glm::normalize(from);
  view.up = {0.1, 0.9, 0.2};
  view.view_angle = 26.0;
  view.width = width;
  view.height = height;
  return view;
}

inline composite::FrameStats drawWith(composite::Compositor& compositor, const Subject& s, const View& view,
                                      const sort::Order& order, Image& image) {
  const project::Camera camera(view);
  return compositor.draw({s.mesh, s.field, s.tf, camera, order}, image);
}

inline sort::Order orderOf(const Subject& s, const View& view, sort::Algorithm algorithm = sort::Algorithm::mpvo) {
  sort::Order order;
  (*sort::makeSorter(algorithm, s.mesh))(viewpoint(view), order);
  return order;
}

}  // namespace spillikin::tests
