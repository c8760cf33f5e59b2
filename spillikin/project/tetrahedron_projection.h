// A tetrahedron on the screen, by the classes of Shirley and Tuchman (1990): one to four triangles, without a search.
#pragma once

#include "spillikin/project/cell_on_screen.h"
#include "spillikin/project/regions.h"

namespace spillikin::project {

// How the four faces are seen decides the class and with it the triangles:
//   three one way, one the other: a corner inside the triangle of the other three, 3 triangles;
//   two and two:                  two edges cross, 4 triangles;
//   two, one, one edge-on:        a corner on an edge of the triangle of the others, 2 triangles;
//   one, one, two edge-on:        a corner behind another, 1 triangle.
// The signs are exact for the corners' screen positions. Appends the regions of a tetrahedron that lies wholly in front
// of the eye; the same regions, up to their order, as the general projection gives. Cost: some 100 flops.
void projectTetrahedron(const CellOnScreen& cell, const Camera& camera, Regions& out);

}  // namespace spillikin::project
