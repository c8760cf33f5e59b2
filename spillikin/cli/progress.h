// A progress bar on stderr: on a terminal only, and only when the work takes over a second.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>

namespace spillikin::cli {

// Give callback() to whoever reports the part done (0 to 1), from any thread. The bar is wiped at the end.
class Progress {
 public:
  explicit Progress(std::string label);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  std::function<void(double)> callback();

 private:
  void show(double part);

  std::string label_;
  bool terminal_;
  bool shown_ = false;
  int last_permille_ = -1;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace spillikin::cli
