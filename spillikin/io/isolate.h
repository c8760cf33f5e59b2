// Work in a child process, so that what crashes there is an error here. Private to io.
#pragma once

#include <functional>
#include <string>

#include "spillikin/mesh/source.h"

namespace spillikin::io {

// Runs `work` in a forked child and returns the source that it makes; `work` gets the function to report progress to
// (empty where `progress` is), which calls `progress` in this process. What `work` throws as Error is thrown here; a
// child that crashes, asks for more memory than the machine has or takes more than `cpu_seconds` ends with an Error
// that names `path`. The child prints nothing. The cost over reading without a child is two copies of the source.
mesh::Source isolate(const std::string& path, const std::function<void(double)>& progress,
                     const std::function<mesh::Source(const std::function<void(double)>&)>& work, unsigned cpu_seconds);

}  // namespace spillikin::io
