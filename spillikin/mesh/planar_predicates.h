// Exact orientation tests in the plane, for points given as doubles and for crossings of segments between such points.
#pragma once

#include <glm/vec2.hpp>

namespace spillikin::mesh {

using Vec2 = glm::dvec2;

// Twice the signed area of a triangle: `value` to within `error`, and the exact sign (-1, 0, 1).
struct SignedArea {
  double value = 0.0;
  double error = 0.0;
  int sign = 0;
};

// Of a, b, c: positive when c lies to the left of a -> b in a frame whose y runs upwards. Cost: some 10 flops when the
// static filter decides, else exact arithmetic.
SignedArea signedArea(const Vec2& a, const Vec2& b, const Vec2& c);

// Sign of the cross product (a1 - a0) x (b1 - b0), exact.
int crossSign(const Vec2& a0, const Vec2& a1, const Vec2& b0, const Vec2& b1);

// The crossing of segments f and g, both crossed in their inside, is f0 |G(f1)| + f1 |G(f0)| divided by the sum of the
// weights, where G(p) is the signed area of g0, g1, p. So its side of the line e is the sign of
// E(f0) |G(f1)| + E(f1) |G(f0)|: exact, with a filter that starts from the four areas already known.
struct Line {
  Vec2 a, b;
};
int sideOfCrossing(const Line& e, const Line& f, const Line& g, const SignedArea& e_f0, const SignedArea& e_f1,
                   const SignedArea& g_f0, const SignedArea& g_f1);

// Where along f its crossing with g lies, 0 at f.a and 1 at f.b, given the areas of g with the ends of f: accurate to
// rounding, by exact arithmetic where the areas are too small to be known well.
double crossingParameter(const Line& f, const Line& g, const SignedArea& g_f0, const SignedArea& g_f1);

}  // namespace spillikin::mesh
