#include "spillikin/composite/gl_shaders.h"

#include "spillikin/integrate/segment_glsl.h"

namespace spillikin::composite {

namespace {

// All lengths and depths are in the frame's unit of length, positions in pixels from the image's centre; see
// gl_frame.h, which fills these blocks.
constexpr const char* declarations = R"(#version 450 core
layout(std140, binding = 0) uniform View {
  vec4 pixel;       // xy: add to gl_FragCoord.xy to get image position; zw: homogeneous weight is z + w * depth
  vec4 lens;        // x: depth of the eye plane, y: squared slope of a ray per pixel, z: unit of length
  vec4 window;      // image position to clip space: xy * position + zw
  ivec4 counts;     // x: clip planes of the view, y: pieces of the transfer function, z: bins of scalar after them
};
// Buffers, read as texels: software rasterizers gather those many times faster than they read storage blocks.
layout(binding = 0) uniform usamplerBuffer cells;      // four texels each, see the vertex shader
layout(binding = 1) uniform samplerBuffer vertices;    // x * h, y * h, depth, scalar
layout(binding = 2) uniform usamplerBuffer triangles;  // three vertices of 10 bits, ascending
layout(binding = 3) uniform samplerBuffer planes;      // two texels each
layout(binding = 4) uniform samplerBuffer pieces;      // three texels each
)";

constexpr const char* vertex_main = R"(
#ifdef TETRAHEDRA
flat out vec4 v0;
flat out vec4 v1;
flat out vec4 v2;
flat out vec4 v3;
#endif
flat out uvec4 at;
#ifdef CELL_FIELD
flat out vec4 paint;
#endif
void main() {
  // Of a cell: the corners of its cover, two to a texel; colour and extinction, for fields that are constant in each
  // cell; first vertex, first triangle, triangles, planes (first << 8 | count).
  int cell = 4 * (gl_VertexID >> 2);
  vec4 two = uintBitsToFloat(texelFetch(cells, cell + ((gl_VertexID >> 1) & 1)));
  vec2 corner = (gl_VertexID & 1) == 0 ? two.xy : two.zw;
  gl_Position = vec4(corner * window.xy + window.zw, 0.0, 1.0);
#ifdef CELL_FIELD
  paint = uintBitsToFloat(texelFetch(cells, cell + 2));
#endif
  at = texelFetch(cells, cell + 3);
#ifdef TETRAHEDRA
  int first = int(at.x);
  v0 = texelFetch(vertices, first);
  v1 = texelFetch(vertices, first + 1);
  v2 = texelFetch(vertices, first + 2);
  v3 = texelFetch(vertices, first + 3);
#endif
}
)";

// Which cells a ray crosses is decided by the signs of edge functions: e(a, b) is the orientation of the image position
// against the projected edge from a to b, a before b by vertex id. The cells around an edge compute it from the same
// floats with the same operations, so that no ray slips between cells or is counted twice, and the depth at which a ray
// crosses a shared triangle is the same number on both sides: the thicknesses of the cells on a ray add up.
constexpr const char* crossing = R"(
struct Corner { vec2 xy; float h; };  // homogeneous, relative to the ray
Corner corner(vec4 v, vec2 p) {
  precise float h = pixel.z + pixel.w * v.z;
  precise vec2 xy = v.xy - p * h;
  return Corner(xy, h);
}
float edge(Corner a, Corner b) {
  precise float e = a.xy.x * b.xy.y - a.xy.y * b.xy.x;
  return e;
}
// The sign of an edge function; a ray exactly through the edge is moved by (t, t^2), t -> 0, as in simulation of
// simplicity, so that it too crosses a consistent set of triangles.
bool left(float e, Corner a, Corner b) {
  precise float dx = b.xy.y * a.h - a.xy.y * b.h;
  precise float dy = a.h * b.xy.x - b.h * a.xy.x;
  return e > 0.0 || (e == 0.0 && (dx < 0.0 || (dx == 0.0 && dy > 0.0)));
}
// Depth and scalar where the ray crosses a triangle, by its edge functions; the weights keep a constant constant.
vec2 crossingOf(vec4 a, vec4 b, vec4 c, float ab, float bc, float ac) {
  precise float d = ab + bc - ac;
  precise float wb = -ac / d;
  precise float wc = ab / d;
  precise vec2 at = a.zw + wb * (b.zw - a.zw) + wc * (c.zw - a.zw);
  return at;
}
)";

// An interval of depths is trimmed by the eye plane, the view's clip planes and the half-spaces of a cut cell, each
// kept where f + depth * g >= 0; the field is left as it was.
constexpr const char* trimming = R"(
void trimBy(int i, vec2 p, inout float near, inout float far) {
  vec4 f = texelFetch(planes, 2 * i);
  vec4 g = texelFetch(planes, 2 * i + 1);
  float at = f.x + f.y * p.x + f.z * p.y;
  float slope = g.x + g.y * p.x + g.z * p.y;
  float depth = -at / slope;
  near = slope > 0.0 ? max(near, depth) : near;
  far = slope < 0.0 ? min(far, depth) : far;
  far = slope == 0.0 && at < 0.0 ? near : far;
}
void trim(vec2 p, uint own, inout float near, inout float far) {
  near = max(near, lens.x);
  for (int i = 0; i < counts.x; ++i) trimBy(i, p, near, far);
  int first = int(own >> 8);
  int end = first + int(own & 255u);
  for (int i = first; i < end; ++i) trimBy(i, p, near, far);
}
)";

constexpr const char* constant_cell = R"(
flat in vec4 paint;
vec4 segment(float front, float back, float len) {
  float alpha = segmentOpacity(paint.a * len);
  return vec4(paint.rgb * alpha, alpha);
}
)";

// A bin of scalar knows a piece that begins before it.
constexpr const char* transfer_lookup = R"(
// The last piece that begins at or before s (strictly before, when descending from it).
int pieceOf(float s, bool descending) {
  int bin = clamp(int(s * float(counts.z)), 0, counts.z - 1);
  int k = int(texelFetch(pieces, 3 * counts.y + bin).x);
  for (int turn = 0; turn < counts.y; ++turn) {
    float end = texelFetch(pieces, 3 * k).y;
    if (descending ? end >= s : end > s) break;
    ++k;
  }
  return k;
}
)";

// The absorption-emission integral over a segment on which the scalar is linear, cut at the breakpoints of the transfer
// function, by the float weights of integrate (6e-6 relative, for thin segments too).
constexpr const char* linear_cell = R"(
const float opaque = 1e-7;  // transmittance under which nothing behind is seen
vec4 segment(float front, float back, float len) {
  float ds = back - front;
  bool descending = ds < 0.0;
  int k = pieceOf(front, descending);
  float t = 0.0;
  float s = front;
  vec3 color = vec3(0.0);
  float alpha = 0.0;
  bool last = false;
  for (int turn = 0; turn < counts.y && !last && 1.0 - alpha > opaque; ++turn) {
    vec4 domain = texelFetch(pieces, 3 * k);  // begin, end, reference, 1 / width
    vec4 low = texelFetch(pieces, 3 * k + 1);
    vec4 rise = texelFetch(pieces, 3 * k + 2);
    float bound = descending ? domain.x : domain.y;
    last = ds == 0.0 || (descending ? bound <= back : bound >= back);
    float s_end = last ? back : bound;
    float t_end = last ? 1.0 : clamp((bound - front) / ds, t, 1.0);
    vec4 a = low + rise * clamp((s - domain.z) * domain.w, 0.0, 1.0);
    vec4 b = low + rise * clamp((s_end - domain.z) * domain.w, 0.0, 1.0);
    float l = len * (t_end - t);
    vec3 w = segmentWeights(a.a * l, b.a * l);
    float through = 1.0 - alpha;
    color += through * (a.rgb * w.x + b.rgb * w.y);
    alpha += through * w.z;
    k += descending ? -1 : 1;
    t = t_end;
    s = s_end;
  }
  return vec4(color, alpha);
}
)";

constexpr const char* average_cell = R"(
vec4 optical(float s) {
  int k = pieceOf(s, false);
  vec4 domain = texelFetch(pieces, 3 * k);
  return texelFetch(pieces, 3 * k + 1) + texelFetch(pieces, 3 * k + 2) * clamp((s - domain.z) * domain.w, 0.0, 1.0);
}
vec4 segment(float front, float back, float len) {
  vec4 mean = 0.5 * (optical(front) + optical(back));
  float alpha = segmentOpacity(mean.a * len);
  return vec4(mean.rgb * alpha, alpha);
}
)";

// integrate::Preintegrated's own look-up: mean extinction T first, then colour times T at optical depth T length.
constexpr const char* preintegrated_cell = R"(
layout(binding = 5) uniform sampler3D table;
vec4 segment(float front, float back, float len) {
  vec3 size = vec3(textureSize(table, 0));
  vec3 at = vec3(front, back, 0.0);
  float extinction = textureLod(table, (clamp(at, 0.0, 1.0) * (size - 1.0) + 0.5) / size, 0.0).a;
  float depth = extinction * len * lens.z;
  at.z = depth / (1.0 + depth);
  vec3 color = textureLod(table, (clamp(at, 0.0, 1.0) * (size - 1.0) + 0.5) / size, 0.0).rgb;
  float alpha = segmentOpacity(depth);
  return extinction > 0.0 ? vec4(color * (alpha / extinction), alpha) : vec4(0.0);
}
)";

constexpr const char* fragment_common = R"(
flat in uvec4 at;
layout(location = 0) out vec4 radiance;  // premultiplied
// The part of the ray between two crossings (depth, scalar), trimmed.
vec4 interval(vec2 p, vec2 front, vec2 back) {
  float near = front.x;
  float far = back.x;
  trim(p, at.w, near, far);
  if (!(far > near)) return vec4(0.0);
  float slope = (back.y - front.y) / (back.x - front.x);
  float s_near = near == front.x ? front.y : front.y + (near - front.x) * slope;
  float s_far = far == back.x ? back.y : front.y + (far - front.x) * slope;
  return segment(s_near, s_far, (far - near) * sqrt(1.0 + lens.y * dot(p, p)));
}
)";

constexpr const char* tetrahedron_main = R"(
flat in vec4 v0;
flat in vec4 v1;
flat in vec4 v2;
flat in vec4 v3;
const float none = 3.0e38;
void main() {
  vec2 p = gl_FragCoord.xy + pixel.xy;
  Corner a = corner(v0, p);
  Corner b = corner(v1, p);
  Corner c = corner(v2, p);
  Corner d = corner(v3, p);
  float ab = edge(a, b);
  float ac = edge(a, c);
  float ad = edge(a, d);
  float bc = edge(b, c);
  float bd = edge(b, d);
  float cd = edge(c, d);
  bool lab = left(ab, a, b);
  bool lac = left(ac, a, c);
  bool lad = left(ad, a, d);
  bool lbc = left(bc, b, c);
  bool lbd = left(bd, b, d);
  bool lcd = left(cd, c, d);
  vec2 front = vec2(none, 0.0);
  vec2 back = vec2(-none, 0.0);
#define MEET(HIT, TRIANGLE)                    \
  {                                            \
    bool hit = HIT;                            \
    vec2 q = TRIANGLE;                         \
    front = hit && q.x < front.x ? q : front;  \
    back = hit && q.x > back.x ? q : back;     \
  }
  MEET(lab == lbc && lab != lac, crossingOf(v0, v1, v2, ab, bc, ac))
  MEET(lab == lbd && lab != lad, crossingOf(v0, v1, v3, ab, bd, ad))
  MEET(lac == lcd && lac != lad, crossingOf(v0, v2, v3, ac, cd, ad))
  MEET(lbc == lcd && lbc != lbd, crossingOf(v1, v2, v3, bc, cd, bd))
  if (!(back.x > front.x)) discard;
  radiance = interval(p, front, back);
  if (radiance.a == 0.0) discard;
}
)";

// The crossings of a cell that need not be convex, by repeated search from the front: a ray seldom crosses more than
// two triangles, and there is no bound on how many to make room for.
constexpr const char* general_main = R"(
const float none = 3.0e38;
const int nothing = 0x7fffffff;
// Depth and scalar of the crossing with triangle i, or none.
vec2 meet(int i, vec2 p) {
  uint corners = texelFetch(triangles, int(at.y) + i).x;
  vec4 va = texelFetch(vertices, int(at.x + (corners & 1023u)));
  vec4 vb = texelFetch(vertices, int(at.x + ((corners >> 10) & 1023u)));
  vec4 vc = texelFetch(vertices, int(at.x + (corners >> 20)));
  Corner a = corner(va, p);
  Corner b = corner(vb, p);
  Corner c = corner(vc, p);
  float ab = edge(a, b);
  float bc = edge(b, c);
  float ac = edge(a, c);
  bool lab = left(ab, a, b);
  bool hit = lab == left(bc, b, c) && lab != left(ac, a, c) && ab + bc - ac != 0.0;
  vec2 q = crossingOf(va, vb, vc, ab, bc, ac);
  return hit ? q : vec2(none, 0.0);
}
struct Crossing { vec2 q; int i; };
// The next crossing behind `last`, by depth, then by number.
Crossing next(Crossing last, vec2 p) {
  Crossing best = Crossing(vec2(none, 0.0), nothing);
  for (int i = 0; i < int(at.z); ++i) {
    vec2 q = meet(i, p);
    bool behind = q.x > last.q.x || (q.x == last.q.x && i > last.i);
    if (behind && q.x < best.q.x) best = Crossing(q, i);
  }
  return best;
}
void main() {
  vec2 p = gl_FragCoord.xy + pixel.xy;
  Crossing front = Crossing(vec2(none, 0.0), nothing);
  Crossing back = Crossing(vec2(-none, 0.0), -1);
  int count = 0;
  for (int i = 0; i < int(at.z); ++i) {
    vec2 q = meet(i, p);
    if (q.x < none) {
      ++count;
      if (q.x < front.q.x) front = Crossing(q, i);
      if (q.x >= back.q.x) back = Crossing(q, i);
    }
  }
  vec4 sum = vec4(0.0);
  while (count >= 2) {
    Crossing exit = back;
    if (count != 2) exit = next(front, p);
    sum += (1.0 - sum.a) * interval(p, front.q, exit.q);
    count -= 2;
    if (count >= 2) front = next(exit, p);
  }
  if (sum.a == 0.0) discard;
  radiance = sum;
}
)";

// The paper's hardware mode (Max, Williams, Silva 2000, section II): thickness and mean extinction are interpolated and
// multiplied in a texture of 1 - exp(-u v), colour is interpolated.
constexpr const char* polygon_vertex_main = R"(
layout(location = 0) in vec2 position;
layout(location = 1) in vec2 coordinates;
layout(location = 2) in vec3 glow;
out vec2 uv;
out vec3 color;
void main() {
  gl_Position = vec4(position * window.xy + window.zw, 0.0, 1.0);
  uv = coordinates;
  color = glow;
}
)";

constexpr const char* polygon_fragment_main = R"(
layout(binding = 5) uniform sampler2D opacity;
in vec2 uv;
in vec3 color;
layout(location = 0) out vec4 radiance;
void main() {
  vec2 size = vec2(textureSize(opacity, 0));
  float alpha = textureLod(opacity, (clamp(uv, 0.0, 1.0) * (size - 1.0) + 0.5) / size, 0.0).r;
  radiance = vec4(color * alpha, alpha);
}
)";

const char* segmentText(SegmentShader segment) {
  switch (segment) {
    case SegmentShader::constant:
      return constant_cell;
    case SegmentShader::average:
      return average_cell;
    case SegmentShader::preintegrated:
      return preintegrated_cell;
    case SegmentShader::exact:
      break;
  }
  return linear_cell;
}

std::string header(const CellShader& shader) {
  std::string text = declarations;
  if (shader.tetrahedra) {
    text += "#define TETRAHEDRA\n";
  }
  if (shader.segment == SegmentShader::constant) {
    text += "#define CELL_FIELD\n";
  }
  return text;
}

}  // namespace

std::string cellVertexShader(const CellShader& shader) {
  return header(shader) + vertex_main;
}

std::string cellFragmentShader(const CellShader& shader) {
  return header(shader) + integrate::segment_glsl + crossing + trimming + transfer_lookup +
         segmentText(shader.segment) + fragment_common + (shader.tetrahedra ? tetrahedron_main : general_main);
}

std::string polygonVertexShader() {
  return std::string(declarations) + polygon_vertex_main;
}

std::string polygonFragmentShader() {
  return std::string(declarations) + polygon_fragment_main;
}

}  // namespace spillikin::composite
