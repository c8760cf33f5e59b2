// Pictures: what is written is read back, and nothing partial is ever left.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "io_samples.h"
#include "spillikin/base/error.h"
#include "spillikin/io/write_image.h"

namespace {

using namespace spillikin;
using tests::TempFolder;

// Premultiplied colours of every kind, also beyond [0, 1].
Image gradient(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float* pixel = image.pixel(x, y);
      pixel[3] = static_cast<float>(x) / static_cast<float>(width);
      for (int c = 0; c < 3; ++c)
        pixel[c] = pixel[3] * static_cast<float>(y + c) / static_cast<float>(height + 2);
    }
  }
  return image;
}

std::size_t filesIn(const TempFolder& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder.path()), std::filesystem::directory_iterator()));
}

template <typename Work>
std::string messageOf(Work work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(std::strchr(error.what(), '\n'), nullptr) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(Image, FloatFormatsKeepEveryBit) {
  const TempFolder folder;
  Image image = gradient(37, 19);
  image.pixel(3, 4)[0] = 1234.5F;
  image.pixel(3, 4)[1] = -1e-30F;
  image.pixel(5, 5)[2] = std::numeric_limits<float>::infinity();
  for (const char* name : {"a.exr", "a.npy", "A.EXR"}) {
    io::writeImage(folder / name, image);
    const Image back = io::readImage(folder / name);
    EXPECT_EQ(back.width, 37);
    EXPECT_EQ(back.height, 19);
    EXPECT_EQ(back.rgba, image.rgba) << name;
  }
  EXPECT_EQ(filesIn(folder), 3U);
}

TEST(Image, PngIsCompositedOnTheBackground) {
  const TempFolder folder;
  const Image image = gradient(16, 16);
  io::writeImage(folder / "a.png", image, {0.2, 0.4, 0.6, 1.0});
  const Image back = io::readImage(folder / "a.png");
  const float background[3] = {0.2F, 0.4F, 0.6F};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const float* in = image.pixel(x, y);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(back.pixel(x, y)[c], in[c] + (1.0F - in[3]) * background[c], 0.5 / 255 + 1e-6);
      }
      EXPECT_EQ(back.pixel(x, y)[3], 1.0F);
    }
  }
}

TEST(Image, PngKeepsAlphaOverATransparentBackground) {
  const TempFolder folder;
  const Image image = gradient(16, 16);
  io::writeImage(folder / "a.png", image, {0, 0, 0, 0});
  const Image back = io::readImage(folder / "a.png");
  for (std::size_t i = 0; i < image.rgba.size(); ++i)
    EXPECT_NEAR(back.rgba[i], image.rgba[i], 1.0 / 255 + 1e-6);
}

TEST(Image, PngTakesWhatIsNotANumberAsNothing) {
  const TempFolder folder;
  Image image(1, 1);
  image.rgba = {std::nanf(""), 7.0F, -3.0F, 1.0F};
  io::writeImage(folder / "a.png", image);
  EXPECT_EQ(io::readImage(folder / "a.png").rgba, (std::vector<float>{0.0F, 1.0F, 0.0F, 1.0F}));
}

TEST(Npy, HoldsTheHeaderAndTheValues) {
  const TempFolder folder;
  io::writeNpy(folder / "order.npy", {3, -1, std::int64_t{1} << 40});
  const std::string bytes = tests::readText(folder / "order.npy");
  ASSERT_GT(bytes.size(), 24U);
  EXPECT_EQ((bytes.size() - 24) % 64, 0U);
  EXPECT_NE(bytes.find("{'descr': '<i8', 'fortran_order': False, 'shape': (3,), }"), std::string::npos);
  std::int64_t values[3];
  std::memcpy(values, bytes.data() + bytes.size() - 24, 24);
  EXPECT_EQ(values[1], -1);
  EXPECT_EQ(values[2], std::int64_t{1} << 40);
  io::writeNpy(folder / "empty.npy", {});
  EXPECT_NE(tests::readText(folder / "empty.npy").find("(0,)"), std::string::npos);
}

TEST(Write, ReplacesAndKeepsModeAndLinks) {
  const TempFolder folder;
  tests::writeText(folder / "a", "old");
  chmod((folder / "a").c_str(), 0640);
  std::filesystem::create_symlink(folder / "a", folder / "link");
  io::writeFile(folder / "link", "new!", 4);
  EXPECT_EQ(tests::readText(folder / "a"), "new!");
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path() / "link"));
  struct stat there {};
  stat((folder / "a").c_str(), &there);
  EXPECT_EQ(there.st_mode & 0777U, 0640U);
  EXPECT_EQ(filesIn(folder), 2U);
}

TEST(Write, NewFilesFollowTheUmask) {
  const TempFolder folder;
  const mode_t before = umask(027);
  io::writeFile(folder / "a", "x", 1);
  umask(before);
  struct stat there {};
  stat((folder / "a").c_str(), &there);
  EXPECT_EQ(there.st_mode & 0777U, 0640U);
}

TEST(Write, UnwritableTargets) {
  const TempFolder folder;
  tests::writeText(folder / "file", "");
  std::filesystem::create_directory(folder.path() / "folder.png");
  const Image image = gradient(4, 4);
  for (const char* name : {"file/a.png", "no/such/a.png", "folder.png"}) {
    const std::string text = messageOf([&] { io::writeImage(folder / name, image); });
    EXPECT_NE(text.find(folder / name), std::string::npos) << text;
  }
  EXPECT_NE(messageOf([&] { io::writeImage(folder / "a.jpg", image); }).find(".png, .exr or .npy"), std::string::npos);
  EXPECT_NE(messageOf([&] { io::writeImage(folder / "a.png", Image()); }).find("no pixels"), std::string::npos);
  EXPECT_EQ(filesIn(folder), 2U);
}

TEST(Write, FullDisk) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full";
  const std::string text = messageOf([] { io::writeFile("/dev/full", "x", 1); });
  EXPECT_NE(text.find("No space left"), std::string::npos) << text;
  EXPECT_NE(text.find("free some space"), std::string::npos) << text;
}

// A file-size limit stops a write in the middle, as a full disk does: the target must stay as it was.
TEST(Write, StoppedInTheMiddleLeavesNothing) {
  const TempFolder folder;
  tests::writeText(folder / "a.npy", "what was there");
  const pid_t child = fork();
  if (child == 0) {
    const rlimit limit{4096, 4096};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      io::writeImage(folder / "a.npy", gradient(64, 64));
      _exit(1);
    } catch (const Error& error) {
      _exit(std::strstr(error.what(), "a.npy") != nullptr && std::strstr(error.what(), "limit") != nullptr ? 0 : 2);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status)) << "the write ended the process";
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_EQ(tests::readText(folder / "a.npy"), "what was there");
  EXPECT_EQ(filesIn(folder), 1U);
}

TEST(ReadImage, RefusesWhatIsNoPicture) {
  const TempFolder folder;
  EXPECT_NE(messageOf([&] { io::readImage(folder / "no.png"); }).find("does not exist"), std::string::npos);
  for (const char* name : {"a.png", "a.exr", "a.npy"}) {
    tests::writeText(folder / name, "");
    EXPECT_NE(messageOf([&] { io::readImage(folder / name); }).find("is empty"), std::string::npos);
    tests::writeText(folder / name, "words");
    messageOf([&] { io::readImage(folder / name); });
    io::writeImage(folder / name, gradient(8, 8));
    const std::string whole = tests::readText(folder / name);
    for (std::size_t size = 1; size < whole.size(); size += 7) {
      tests::writeText(folder / name, whole.substr(0, size));
      try {
        EXPECT_EQ(io::readImage(folder / name).rgba.size(), 256U);  // only a trailer is missing
        EXPECT_GT(size + 16, whole.size()) << name;
      } catch (const Error&) {
      }
    }
  }
  io::writeNpy(folder / "order.npy", {1, 2, 3});
  EXPECT_NE(messageOf([&] { io::readImage(folder / "order.npy"); }).find("<f4"), std::string::npos);
}

}  // namespace
