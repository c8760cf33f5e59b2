// Files written whole or not at all: the bytes go to a temporary file beside the target, which is then renamed.
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "spillikin/base/error.h"
#include "spillikin/io/write_image.h"

namespace spillikin::io {
namespace {

// While it lives, a write beyond the process's file-size limit fails with EFBIG instead of ending the process.
class SizeSignalHeld {
 public:
  SizeSignalHeld() {
    sigemptyset(&mask_);
    sigaddset(&mask_, SIGXFSZ);
    pthread_sigmask(SIG_BLOCK, &mask_, &before_);
  }
  ~SizeSignalHeld() {
    const timespec now{};
    while (sigismember(&before_, SIGXFSZ) == 0 && sigtimedwait(&mask_, nullptr, &now) > 0) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  SizeSignalHeld(const SizeSignalHeld&) = delete;
  SizeSignalHeld& operator=(const SizeSignalHeld&) = delete;

 private:
  sigset_t mask_{}, before_{};
};

[[noreturn]] void fail(const std::string& path, int error) {
  const char* remedy = "name a file in a folder that exists and may be written to";
  if (error == ENOSPC || error == EDQUOT) remedy = "free some space or write to another disk";
  if (error == EFBIG) remedy = "raise the file-size limit (ulimit -f) or write a smaller image";
  throw Error(fmt::format("cannot write '{}': {}; {}", path, std::strerror(error), remedy));
}

// Returns 0 or errno.
int writeAll(int file, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(file, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return written == 0 ? ENOSPC : errno;
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
  return 0;
}

// A device or a pipe cannot be replaced: it takes the bytes as they come.
void writeThrough(const std::string& path, const char* bytes, std::size_t size) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (file < 0) fail(path, errno);
  int error = writeAll(file, bytes, size);
  if (::close(file) != 0 && error == 0) error = errno;
  if (error != 0) fail(path, error);
}

mode_t defaultMode(const std::string& target) {
  struct stat there {};
  if (::stat(target.c_str(), &there) == 0) return there.st_mode & 07777;
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666 & ~mask;
}

// A link keeps pointing where it points: its target is what is replaced.
std::string resolved(const std::string& path) {
  struct stat there {};
  if (::lstat(path.c_str(), &there) != 0 || !S_ISLNK(there.st_mode)) return path;
  char* real = ::realpath(path.c_str(), nullptr);
  if (real == nullptr) return path;
  std::string target(real);
  std::free(real);
  return target;
}

}  // namespace

void writeFile(const std::string& path, const void* bytes, std::size_t size) {
  if (path.empty()) throw Error("cannot write a file without a name; give the output a name");
  const SizeSignalHeld held;
  const char* data = static_cast<const char*>(bytes);
  struct stat there {};
  const bool exists = ::stat(path.c_str(), &there) == 0;
  if (exists && S_ISDIR(there.st_mode)) fail(path, EISDIR);
  if (exists && !S_ISREG(there.st_mode)) return writeThrough(path, data, size);

  const std::string target = resolved(path);
  std::string part = target + ".XXXXXX";
  const int file = ::mkostemp(part.data(), O_CLOEXEC);
  if (file < 0) fail(path, errno);
  int error = writeAll(file, data, size);
  if (error == 0 && ::fchmod(file, defaultMode(target)) != 0) error = errno;
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(part.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(part.c_str());
    fail(path, error);
  }
}

}  // namespace spillikin::io
