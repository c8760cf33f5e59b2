// OpenEXR: float channels R, G, B, A, compressed without loss.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "spillikin/base/error.h"
#include "spillikin/io/codecs.h"

namespace spillikin::io {
namespace {

constexpr const char* channel_names[4] = {"R", "G", "B", "A"};

class MemoryOut : public Imf::OStream {
 public:
  MemoryOut() : Imf::OStream("memory") {}
  void write(const char* data, int count) override {
    const std::size_t end = position_ + static_cast<std::size_t>(count);
    if (end > bytes.size()) bytes.resize(end);
    std::memcpy(bytes.data() + position_, data, static_cast<std::size_t>(count));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }

  Bytes bytes;

 private:
  std::size_t position_ = 0;
};

class MemoryIn : public Imf::IStream {
 public:
  explicit MemoryIn(const Bytes& bytes) : Imf::IStream("memory"), bytes_(bytes) {}
  bool read(char* data, int count) override {
    const auto wanted = static_cast<std::size_t>(count);
    if (count < 0 || position_ > bytes_.size() || wanted > bytes_.size() - position_) throw Error("it ends too early");
    std::memcpy(data, bytes_.data() + position_, wanted);
    position_ += wanted;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  const Bytes& bytes_;
  std::size_t position_ = 0;
};

// The four float channels of `rgba`, whose first pixel is at (x, y) of the data window.
Imf::FrameBuffer frameBuffer(float* rgba, int x, int y, int width) {
  Imf::FrameBuffer frame;
  const std::size_t pixel = 4 * sizeof(float);
  const std::size_t row = pixel * static_cast<std::size_t>(width);
  const std::ptrdiff_t start = static_cast<std::ptrdiff_t>(pixel) * x + static_cast<std::ptrdiff_t>(row) * y;
  for (int c = 0; c < 4; ++c) {
    char* base = reinterpret_cast<char*>(rgba + c) - start;
    frame.insert(channel_names[c], Imf::Slice(Imf::FLOAT, base, pixel, row, 1, 1, c == 3 ? 1.0 : 0.0));
  }
  return frame;
}

}  // namespace

Bytes encodeExr(const Image& image) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const char* name : channel_names)
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
  MemoryOut out;
  {
    Imf::OutputFile file(out, header);
    file.setFrameBuffer(frameBuffer(const_cast<float*>(image.rgba.data()), 0, 0, image.width));
    file.writePixels(image.height);
  }
  return std::move(out.bytes);
}

Image decodeExr(const Bytes& bytes) {
  MemoryIn in(bytes);
  Imf::InputFile file(in);
  const auto window = file.header().dataWindow();
  const long long width = static_cast<long long>(window.max.x) - window.min.x + 1;
  const long long height = static_cast<long long>(window.max.y) - window.min.y + 1;
  if (width < 1 || height < 1 || width > 65536 || height > 65536) throw Error("its size is not that of a picture");
  if (file.header().channels().findChannel("R") == nullptr) throw Error("it has no channel R");
  Image image(static_cast<int>(width), static_cast<int>(height));
  file.setFrameBuffer(frameBuffer(image.rgba.data(), window.min.x, window.min.y, image.width));
  file.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace spillikin::io
