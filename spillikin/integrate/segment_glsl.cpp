#include "spillikin/integrate/segment_glsl.h"

namespace spillikin::integrate {

// The preprocessor leaves no line breaks, and GLSL needs none.
#define SPILLIKIN_GLSL(...) #__VA_ARGS__
const char* const segment_glsl =
#include "spillikin/integrate/segment_glsl.inc"
    ;
#undef SPILLIKIN_GLSL

}  // namespace spillikin::integrate
