// The `spillikin` command. Exit status: 0 done, 1 the work could not be done, 2 the arguments are wrong.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/cli/commands.h"

namespace {

constexpr int cannot_be_done = 1;
constexpr int wrong_arguments = 2;

int fail(const std::string& what, int status) {
  std::string line = what;
  for (char& c : line) {
    if (c == '\n') c = ' ';
  }
  std::fprintf(stderr, "spillikin: error: %s\n", line.c_str());
  return status;
}

const char* const examples =
    "Examples:\n"
    "  spillikin render mesh.vtu                               a good picture, in mesh.png\n"
    "  spillikin render mesh.ex2 --field Temp --azimuth 30 --tf inferno -o hot.png\n"
    "  spillikin render mesh.vtu --size 512x512 -o fast.exr && spillikin reference mesh.vtu --size 512x512 -o "
    "true.exr\n"
    "  spillikin compare fast.exr true.exr --max 0.004         exit status 1 when a pixel differs by more\n"
    "  spillikin info mesh.vtu                                 what is in the file, and which order is exact for it\n"
    "  spillikin sort mesh.vtu --verify                        proves the order on every pixel\n";

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Volume-renders unstructured finite-element meshes directly, exactly and without a screen.",
               "spillikin"};
  app.footer(examples);
  app.set_version_flag("--version", SPILLIKIN_VERSION);
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::simple);

  using namespace spillikin::cli;
  std::vector<std::pair<std::string, Command>> commands;
  commands.emplace_back("render", addRender(app));
  commands.emplace_back("reference", addReference(app));
  commands.emplace_back("compare", addCompare(app));
  commands.emplace_back("sort", addSort(app));
  commands.emplace_back("info", addInfo(app));
  commands.emplace_back("bench", addBench(app));

  try {
    app.parse(argc, argv);
    for (const auto& [command, run] : commands) {
      if (app.got_subcommand(command)) return run();
    }
    return wrong_arguments;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
    return fail(std::string(e.what()) + "; see spillikin --help", wrong_arguments);
  } catch (const spillikin::Error& e) {
    return fail(e.what(), cannot_be_done);
  } catch (const std::bad_alloc&) {
    return fail("not enough memory for this mesh and image; use a smaller --size, or a machine with more",
                cannot_be_done);
  } catch (const std::exception& e) {
    return fail(e.what(), cannot_be_done);
  }
}
