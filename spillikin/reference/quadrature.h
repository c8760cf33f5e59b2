// The absorption-emission integral by adaptive quadrature, independent of every closed form.
#pragma once

#include "spillikin/integrate/segment.h"

namespace spillikin::reference {

// What integrate::integrate computes, by adaptive Gauss-Kronrod quadrature of c tau exp(-depth) between breakpoints.
// Absolute accuracy quadrature_tolerance per piece between two breakpoints.
inline constexpr double quadrature_tolerance = 1e-13;
integrate::Radiance quadrature(const integrate::TransferFunction& tf, double front, double back, double length);

}  // namespace spillikin::reference
