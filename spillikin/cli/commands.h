// One function per command: adds it to the program and returns what runs it.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace spillikin::cli {

// Each adds its subcommand to `app`. The returned function does the work, prints to stdout, and returns the exit
// status; it throws spillikin::Error for what cannot be done and CLI::ValidationError for wrong arguments.
using Command = std::function<int()>;
Command addRender(CLI::App& app);
Command addReference(CLI::App& app);
Command addCompare(CLI::App& app);
Command addSort(CLI::App& app);
Command addInfo(CLI::App& app);
Command addBench(CLI::App& app);

}  // namespace spillikin::cli
