// The weights of a linear segment for a fragment shader.
#pragma once

namespace spillikin::integrate {

// GLSL (1.30 and later), to be put before a shader's own functions:
//   vec3 segmentWeights(float x, float y)   front, back, alpha; x and y = extinction at the ends * length, both >= 0
//   float segmentOpacity(float depth)       1 - exp(-depth), accurate for thin segments too
// Formulas and error bound are those of psi_float.h (6e-6 relative, from the tests' run of this very text on floats).
extern const char* const segment_glsl;

}  // namespace spillikin::integrate
