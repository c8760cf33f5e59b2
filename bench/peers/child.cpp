#include "bench/peers/child.h"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <exception>

#include "spillikin/base/error.h"

namespace spillikin::bench {

namespace {

constexpr char end_of_row = '\0', thrown = '\1';  // a row that starts with `thrown` is the message of an exception

void put(int to, const std::string& row) {
  const std::size_t size = row.size() + 1;  // with the terminator, which is the end of the row
  for (std::size_t done = 0; done < size;) {
    const ssize_t n = write(to, row.c_str() + done, size - done);
    if (n <= 0) _exit(1);
    done += static_cast<std::size_t>(n);
  }
}

std::string readAll(int from) {
  std::string all;
  std::array<char, 4096> buffer{};
  for (ssize_t n = 0; (n = read(from, buffer.data(), buffer.size())) > 0;)
    all.append(buffer.data(), static_cast<std::size_t>(n));
  return all;
}

}  // namespace

Rows rowsOfChild(const std::function<void(const std::function<void(const std::string&)>&)>& work) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw Error("no pipe can be had");
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw Error("no process can be had");
  if (child == 0) {
    close(ends[0]);
    try {
      work([&](const std::string& row) { put(ends[1], row); });
    } catch (const std::exception& e) {
      put(ends[1], thrown + std::string(e.what()));
    }
    _exit(0);
  }
  close(ends[1]);
  const std::string all = readAll(ends[0]);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  Rows out;
  out.crashed = !WIFEXITED(status) || WEXITSTATUS(status) != 0;
  for (std::size_t at = 0, end = 0; (end = all.find(end_of_row, at)) != std::string::npos; at = end + 1) {
    if (all[at] == thrown) throw Error(all.substr(at + 1, end - at - 1));
    out.rows.push_back(all.substr(at, end - at));
  }
  return out;
}

}  // namespace spillikin::bench
