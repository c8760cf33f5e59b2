// Pictures as the bytes of a file and back, one pair per format; no file is touched here. Private to io.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "spillikin/base/image.h"

namespace spillikin::io {

using Bytes = std::vector<unsigned char>;

// The encoders throw std::exception where the library they use fails; the decoders throw Error whose text says what is
// wrong, without the file's name.
Bytes encodePng(const Image& image, const std::array<double, 4>& background);
Image decodePng(const Bytes& bytes);
Bytes encodeExr(const Image& image);
Image decodeExr(const Bytes& bytes);
Bytes encodeNpy(const Image& image);
Image decodeNpy(const Bytes& bytes);

}  // namespace spillikin::io
