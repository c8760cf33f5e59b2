// Dawson's function and the scaled complementary error function, in double precision.
#pragma once

namespace spillikin::integrate {

// Both take x >= 0 (infinity too), err by less than 1e-15 relative and cost one polynomial of 18 to 26 terms. The
// pieces are Chebyshev interpolants; scripts/special_function_tables.cpp computes them in quadruple precision.

// F(x) = exp(-x^2) integral of exp(t^2) for t from 0 to x.
double dawson(double x);

// exp(x^2) erfc(x), without overflow or underflow.
double erfcx(double x);

// 2 x F(x) and sqrt(pi) x erfcx(x): both are 0 at 0 and tend to 1, from above and from below, so that what is divided
// by x keeps its accuracy where x overflows.
double scaledDawson(double x);
double scaledErfcx(double x);

}  // namespace spillikin::integrate
