#include "spillikin/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace spillikin::cli {

namespace {
constexpr double quiet_seconds = 1.0;
constexpr int bar_width = 30;
}  // namespace

Progress::Progress(std::string label) : label_(std::move(label)), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

std::function<void(double)> Progress::callback() {
  if (!terminal_) return {};
  return [this](double part) { show(part); };
}

void Progress::show(double part) {
  const std::scoped_lock lock(mutex_);
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (elapsed < quiet_seconds) return;
  part = std::clamp(part, 0.0, 1.0);
  const int permille = static_cast<int>(part * 1000.0);
  if (permille <= last_permille_) return;
  last_permille_ = permille;
  shown_ = true;
  const int full = static_cast<int>(part * bar_width);
  const std::string left = part > 0.02 ? fmt::format(", {:.0f} s left", elapsed * (1.0 - part) / part) : "";
  fmt::print(stderr, "\r\033[K{} [{}{}] {:3.0f} %{}", label_, std::string(static_cast<std::size_t>(full), '#'),
             std::string(static_cast<std::size_t>(bar_width - full), ' '), part * 100.0, left);
  std::fflush(stderr);
}

}  // namespace spillikin::cli
