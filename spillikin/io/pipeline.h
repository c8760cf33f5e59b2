// One way to run any reader of VTK: times, step, progress, errors. Private to io.
#pragma once

#include <functional>

#include "spillikin/io/reader.h"

class vtkAlgorithm;

namespace spillikin::io {

// Asks `reader` what is in the file, lets `select` choose arrays and blocks, reads the step of the request and converts
// it. What VTK reports as an error is thrown as Error; its warnings are dropped. Nothing reaches the terminal.
mesh::Source run(vtkAlgorithm* reader, const Request& request, const std::function<void()>& select = {});

// The same for something other than a vtkAlgorithm: throws what VTK complains of during `work`.
void guarded(const Request& request, const std::function<void()>& work);

// VTK's readers use only the calling thread from now on, in this process.
void useOneThread();

}  // namespace spillikin::io
