// The one exception type of the library.
#pragma once

#include <stdexcept>
#include <string>

namespace spillikin {

// Thrown by every room when the work cannot be done. what() is one line that names the thing (file, array, cell),
// says what is wrong with it and what to do about it, without a trailing full stop or newline. Nothing else is thrown
// on purpose across the library's border, and the library never prints.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace spillikin
