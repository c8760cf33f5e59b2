// Work in a child process that hands back rows of text as it makes them: a peer that crashes ends its rows, not the
// report.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace spillikin::bench {

struct Rows {
  std::vector<std::string> rows;  // what the child handed back before it ended
  bool crashed = false;
};

// Runs `work` in a forked child; it calls its argument with each row. What it throws as std::exception is thrown here
// as Error. To be called while this process has no other threads.
Rows rowsOfChild(const std::function<void(const std::function<void(const std::string&)>&)>& work);

}  // namespace spillikin::bench
