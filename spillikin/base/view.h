// Where the picture is taken from: plain values that every room may read.
#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

namespace spillikin {

using Vec3 = glm::dvec3;
using Vec4 = glm::dvec4;

// Keeps the side of the plane through `point` that `normal` points to. `normal` need not be a unit vector.
struct ClipPlane {
  Vec3 point{0.0};
  Vec3 normal{0.0, 0.0, 1.0};
};

// A view means what it means in VTK: the eye looks at the target with `up` towards the top of the image; only the
// part of `up` perpendicular to the line of sight counts. Positions are world coordinates.
//
// The ray of image position (x, y), in pixels from the top left corner, is
//   perspective:  eye + w * (forward + h (2 (x - width/2)/height) right + h (2 (height/2 - y)/height) top),  w > 0,
//                 h = tan(view_angle / 2);
//   parallel:     eye + H (2 (x - width/2)/height) right + H (2 (height/2 - y)/height) top + w * forward,  H =
//   parallel_scale,
//                 w of any sign: a parallel view has no eye plane.
// forward, right and top are unit vectors, so that w is depth along the line of sight in world units.
struct View {
  Vec3 eye{0.0, 0.0, 1.0};
  Vec3 target{0.0};
  Vec3 up{0.0, 1.0, 0.0};
  double view_angle = 30.0;     // full vertical angle in degrees; perspective only
  double parallel_scale = 0.0;  // half the view's height in world units; > 0 makes the view parallel
  int width = 1024;             // pixels
  int height = 768;             // pixels
  std::vector<ClipPlane> clips;

  bool parallel() const { return parallel_scale > 0.0; }
};

// What a visibility sort needs of a view, as a homogeneous point: (eye, 1) for perspective; (towards the viewer, 0) for
// parallel, that is, minus the direction of sight. The sign of plane . viewpoint says on which side of a plane the
// viewer is, in both cases.
using Viewpoint = Vec4;

// Cost: constant. The view must be valid (see project::Camera for the checks).
inline Viewpoint viewpoint(const View& view) {
  return view.parallel() ? Viewpoint(view.eye - view.target, 0.0) : Viewpoint(view.eye, 1.0);
}

}  // namespace spillikin
