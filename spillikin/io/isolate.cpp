#include "spillikin/io/isolate.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <type_traits>

#include "spillikin/base/error.h"
#include "spillikin/io/pipeline.h"

namespace spillikin::io {
namespace {

// ---- The stream between the two: a tag, then what belongs to it
// ------------------------------------------------------

enum class Tag : char { progress = 'p', error = 'e', source = 's' };

// Thrown where the other end is gone; never leaves this file.
struct Broken {};

class Sender {
 public:
  explicit Sender(int file) : file_(file) {}

  void bytes(const void* data, std::size_t size) {
    const char* at = static_cast<const char*>(data);
    while (size > 0) {
      const ssize_t written = ::write(file_, at, size);
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) throw Broken{};
      at += written;
      size -= static_cast<std::size_t>(written);
    }
  }
  template <typename T>
  void value(const T& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes(&v, sizeof v);
  }
  template <typename Sequence>
  void sequence(const Sequence& s) {
    value(static_cast<std::uint64_t>(s.size()));
    bytes(s.data(), s.size() * sizeof(*s.data()));
  }

 private:
  int file_;
};

class Receiver {
 public:
  explicit Receiver(int file) : file_(file) {}

  void bytes(void* data, std::size_t size) {
    char* at = static_cast<char*>(data);
    while (size > 0) {
      const ssize_t got = ::read(file_, at, size);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) throw Broken{};
      at += got;
      size -= static_cast<std::size_t>(got);
    }
  }
  template <typename T>
  T value() {
    T v{};
    bytes(&v, sizeof v);
    return v;
  }
  template <typename Sequence>
  void sequence(Sequence& s) {
    s.resize(value<std::uint64_t>());
    bytes(s.data(), s.size() * sizeof(*s.data()));
  }

 private:
  int file_;
};

void send(Sender& out, const mesh::Source& source) {
  out.value(Tag::source);
  out.sequence(source.name);
  out.sequence(source.points);
  out.sequence(source.types);
  out.sequence(source.offsets);
  out.sequence(source.connectivity);
  out.sequence(source.left_out);
  out.value(static_cast<std::uint64_t>(source.arrays.size()));
  for (const mesh::Array& array : source.arrays) {
    out.sequence(array.name);
    out.value(array.association);
    out.value(array.components);
    out.value(array.identifier);
    out.sequence(array.values);
  }
  out.sequence(source.times);
  out.value(static_cast<std::uint64_t>(source.step));
}

mesh::Source receive(Receiver& in) {
  mesh::Source source;
  in.sequence(source.name);
  in.sequence(source.points);
  in.sequence(source.types);
  in.sequence(source.offsets);
  in.sequence(source.connectivity);
  in.sequence(source.left_out);
  source.arrays.resize(in.value<std::uint64_t>());
  for (mesh::Array& array : source.arrays) {
    in.sequence(array.name);
    array.association = in.value<mesh::Association>();
    array.components = in.value<int>();
    array.identifier = in.value<bool>();
    in.sequence(array.values);
  }
  in.sequence(source.times);
  source.step = in.value<std::uint64_t>();
  return source;
}

// ---- The child ------------------------------------------------------------------------------------------------------

// No more memory than the machine has, so that a corrupt count fails at once; a bound on time; no core file.
void limitResources(unsigned cpu_seconds) {
  const auto page = static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
  rlim_t used = 0;
  std::ifstream("/proc/self/statm") >> used;
  const auto lower = [](decltype(RLIMIT_AS) what, rlim_t value) {
    rlimit limit{};
    if (getrlimit(what, &limit) != 0) return;
    limit.rlim_cur = std::min(limit.rlim_max, std::min(limit.rlim_cur, value));
    setrlimit(what, &limit);
  };
  lower(RLIMIT_AS, (used + static_cast<rlim_t>(sysconf(_SC_PHYS_PAGES))) * page);
  lower(RLIMIT_CPU, cpu_seconds);
  lower(RLIMIT_CORE, 0);
}

// A child inherits one thread, and the locks of all the others: it does as little as possible before its own work.
void settle(pid_t parent, unsigned cpu_seconds) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTERM, SIGINT, SIGHUP, SIGXCPU}) {
    signal(number, SIG_DFL);
  }
  signal(SIGPIPE, SIG_IGN);
  std::atexit([] { _exit(3); });  // a library that calls exit must not run what the parent has registered
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int null = ::open("/dev/null", O_RDWR);
  if (null >= 0) {
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
  }
  limitResources(cpu_seconds);
}

using Work = std::function<mesh::Source(const std::function<void(double)>&)>;

[[noreturn]] void child(int pipe, const Work& work, bool wants_progress) {
  Sender out(pipe);
  std::function<void(double)> report;
  double last = -1.0;
  if (wants_progress) {
    report = [&](double done) {
      if (!(std::abs(done - last) >= 0.01)) return;
      last = done;
      out.value(Tag::progress);
      out.value(done);
    };
  }
  try {
    try {
      send(out, work(report));
    } catch (const Error& error) {
      out.value(Tag::error);
      out.sequence(std::string(error.what()));
    }
  } catch (const Broken&) {
    _exit(1);
  } catch (const std::bad_alloc&) {
    _exit(2);
  } catch (...) {
    _exit(3);
  }
  _exit(0);
}

// ---- The parent -----------------------------------------------------------------------------------------------------

// Ends the child, whatever happens here, and collects it.
class Child {
 public:
  Child(pid_t pid, int pipe) : pid_(pid), pipe_(pipe) {}
  ~Child() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      wait();
    }
    ::close(pipe_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  // Its status as waitpid gives it; -1 when someone else has collected it.
  int wait() {
    int status = 0;
    pid_t got = 0;
    do {
      got = waitpid(pid_, &status, 0);
    } while (got < 0 && errno == EINTR);
    pid_ = 0;
    return got < 0 ? -1 : status;
  }

 private:
  pid_t pid_;
  int pipe_;
};

[[noreturn]] void lost(const std::string& path, int status, unsigned cpu_seconds) {
  std::string what = "its reader gave up";
  if (status >= 0 && WIFSIGNALED(status)) what = fmt::format("its reader crashed ({})", strsignal(WTERMSIG(status)));
  if (status >= 0 && WIFEXITED(status) && WEXITSTATUS(status) == 2) what = "it asks for more memory than there is";
  if (status >= 0 && WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
    what = fmt::format("its reader was still busy after {} seconds", cpu_seconds);
  }
  throw Error(fmt::format("cannot read '{}': {}; the file is damaged, copy or export it again", path, what));
}

}  // namespace

mesh::Source isolate(const std::string& path, const std::function<void(double)>& progress, const Work& work,
                     unsigned cpu_seconds) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    throw Error(fmt::format("cannot read '{}': {}; close some files", path, std::strerror(errno)));
  }
  constexpr int pipe_bytes = 1 << 20;
  fcntl(ends[1], F_SETPIPE_SZ, pipe_bytes);  // larger is faster; without it, it works too
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) {
    ::close(ends[0]);
    settle(parent, cpu_seconds);
    useOneThread();  // the parent's worker threads are not here
    child(ends[1], work, static_cast<bool>(progress));
  }
  const int fork_error = errno;
  ::close(ends[1]);
  Child reader(pid, ends[0]);
  if (pid < 0) {
    throw Error(fmt::format("cannot read '{}': {}; end some processes", path, std::strerror(fork_error)));
  }
  Receiver in(ends[0]);
  try {
    while (true) {
      const Tag tag = in.value<Tag>();
      if (tag == Tag::progress) {
        progress(in.value<double>());
      } else if (tag == Tag::error) {
        std::string text;
        in.sequence(text);
        throw Error(text);
      } else if (tag == Tag::source) {
        return receive(in);
      } else {
        throw Broken{};
      }
    }
  } catch (const Broken&) {
  } catch (const std::bad_alloc&) {
    throw Error(fmt::format("cannot read '{}': there is not enough memory for it; use a larger machine", path));
  } catch (const std::length_error&) {
  }
  lost(path, reader.wait(), cpu_seconds);
}

}  // namespace spillikin::io
