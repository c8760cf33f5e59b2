// Writing pictures, whole or not at all.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "spillikin/base/image.h"

namespace spillikin::io {

// By suffix: .png (8-bit, composited on the background; with alpha when background[3] < 1), .exr and .npy (float32,
// height x width x 4, premultiplied, before the background). Written beside the target and renamed, so that nothing
// partial is ever left. Throws Error: unknown suffix, target that cannot be written, disk full.
void writeImage(const std::string& path, const Image& image, const std::array<double, 4>& background = {0, 0, 0, 1});

// Whether the path ends in a suffix that writeImage and readImage know.
bool knownImageSuffix(const std::string& path);

// Whether writeImage could write there, as far as that can be told before the picture is made: a known suffix, a folder
// that exists and takes files. Throws the Error that writeImage would.
void checkImagePath(const std::string& path);

// Reads .png (8 bits to [0, 1], alpha 1 when it has none; premultiplied), .exr and .npy of the shape above.
Image readImage(const std::string& path);

// Any bytes, whole or not at all: for JSON, .npy orders, images.
void writeFile(const std::string& path, const void* bytes, std::size_t size);

// A one-dimensional int64 .npy. Same errors.
void writeNpy(const std::string& path, const std::vector<std::int64_t>& values);

}  // namespace spillikin::io
