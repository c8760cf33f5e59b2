// The backends' makers, one per file; makeCompositor chooses among them.
#pragma once

#include <memory>

#include "spillikin/composite/compositor.h"

namespace spillikin::composite {

// Each throws Error when its device is not available here, with the reason.
std::unique_ptr<Compositor> makeNative();
std::unique_ptr<Compositor> makeOsmesa();
std::unique_ptr<Compositor> makeEgl();

}  // namespace spillikin::composite
