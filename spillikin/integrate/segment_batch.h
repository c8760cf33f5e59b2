// Many segments at once, for the best instruction set the machine has.
#pragma once

#include <cstddef>
#include <span>

namespace spillikin::integrate {

// front[i], back[i], alpha[i] = the weights of x[i], y[i] (psi_float.h: to 6e-6 relative). All five spans have the same
// size; the caller owns them. Cost: some 30 flops each where thin, in full vectors.
void weights(std::span<const float> x, std::span<const float> y, std::span<float> front, std::span<float> back,
             std::span<float> alpha);

}  // namespace spillikin::integrate
