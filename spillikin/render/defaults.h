// What a picture looks like before anyone has said a word about it.
#pragma once

#include "spillikin/base/view.h"
#include "spillikin/integrate/transfer_function.h"
#include "spillikin/mesh/field.h"
#include "spillikin/mesh/mesh.h"

namespace spillikin::render {

// The axis-aligned box of a mesh's vertices, in world units. Cost: linear.
struct Box {
  Vec3 lower{0.0}, upper{0.0};
};
Box boundingBox(const mesh::Mesh& mesh);

// How the automatic view is turned: azimuth about `up`, then elevation about the horizontal axis, both about the
// target and in degrees; zoom divides the view angle, or the parallel scale, by its factor (> 0).
struct Turn {
  double azimuth = 0.0, elevation = 0.0, zoom = 1.0;
};

// Places the eye of `view` so that the whole box is in sight: along -z with +y up, at the distance at which the box's
// bounding sphere just fits the narrower side of the image, as VTK's ResetCamera does; then turned. Reads view_angle,
// width, height and parallel_scale (> 0 keeps the view parallel, with the scale given) and sets eye, target and up.
void placeEye(View& view, const Box& box, const Turn& turn);

// The same turn, applied to a view whose eye and target are already set.
void turnView(View& view, const Turn& turn);

// The parallel scale at which the whole box is in sight.
double fittingParallelScale(const Box& box, int width, int height);

// The factor for the extinction of `look`, a transfer function in the field's units, at which a typical ray keeps
// `transmittance` of its light: the median, over rays along the three axes that meet the mesh, of the optical depth is
// made -ln(transmittance). The depths are estimated by the cells' volumes, each lumped at the cell's middle in a coarse
// grid of columns. 1 where nothing absorbs. Cost: linear in the cells.
double extinctionFactor(const mesh::Mesh& mesh, const mesh::Field& field, const integrate::TransferFunction& look,
                        double transmittance = 1.0 / 3.0);

// The preset over the field's range, at the extinction at which a typical ray keeps a third of its light. Throws Error
// when no preset has the name.
integrate::TransferFunction typicalLook(const mesh::Mesh& mesh, const mesh::Field& field, const char* preset);

}  // namespace spillikin::render
