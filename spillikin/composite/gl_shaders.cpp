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
#if CORNERS >= 4
flat out vec4 v0;
flat out vec4 v1;
flat out vec4 v2;
flat out vec4 v3;
#endif
#if CORNERS == 8
flat out vec4 v4;
flat out vec4 v5;
flat out vec4 v6;
flat out vec4 v7;
#endif
flat out uvec4 at;
#ifdef CELL_FIELD
flat out vec4 paint;
#endif
void main() {
  // Of a cell: the corners of its cover, two to a texel; colour and extinction, for fields that are constant in each
  // cell; first vertex, first triangle or diagonals, triangles, planes (first << 8 | count).
  int cell = 4 * (gl_VertexID >> 2);
  vec4 two = uintBitsToFloat(texelFetch(cells, cell + ((gl_VertexID >> 1) & 1)));
  vec2 corner = (gl_VertexID & 1) == 0 ? two.xy : two.zw;
  gl_Position = vec4(corner * window.xy + window.zw, 0.0, 1.0);
#ifdef CELL_FIELD
  paint = uintBitsToFloat(texelFetch(cells, cell + 2));
#endif
  at = texelFetch(cells, cell + 3);
#if CORNERS >= 4
  int first = int(at.x);
  v0 = texelFetch(vertices, first);
  v1 = texelFetch(vertices, first + 1);
  v2 = texelFetch(vertices, first + 2);
  v3 = texelFetch(vertices, first + 3);
#endif
#if CORNERS == 8
  v4 = texelFetch(vertices, first + 4);
  v5 = texelFetch(vertices, first + 5);
  v6 = texelFetch(vertices, first + 6);
  v7 = texelFetch(vertices, first + 7);
#endif
}
)";

// Which cells a ray crosses is decided by the signs of edge functions: e(a, b) is the orientation of the image position
// against the projected edge from a to b, and e(b, a) is minus that to the last bit. The cells around an edge compute
// it from the same floats, so that no ray slips between cells or is counted twice, and the depths at which a ray
// crosses a shared triangle agree on both sides: the thicknesses of the cells on a ray add up.
constexpr const char* crossing = R"(
struct Corner { vec2 xy; float h; vec2 q; };  // homogeneous, relative to the ray; depth and scalar
Corner corner(vec4 v, vec2 p) {
  precise float h = pixel.z + pixel.w * v.z;
  precise vec2 xy = v.xy - p * h;
  return Corner(xy, h, v.zw);
}
// The function of an edge and its sign; a ray exactly through the edge is moved by (t, t^2), t -> 0, as in simulation of
// simplicity, so that it too crosses a consistent set of triangles.
struct Edge { float e; bool left; };
Edge edge(Corner a, Corner b) {
  precise float e = a.xy.x * b.xy.y - a.xy.y * b.xy.x;
  precise float dx = b.xy.y * a.h - a.xy.y * b.h;
  precise float dy = a.h * b.xy.x - b.h * a.xy.x;
  return Edge(e, e > 0.0 || (e == 0.0 && (dx < 0.0 || (dx == 0.0 && dy > 0.0))));
}
bool crossed(Edge ab, Edge bc, Edge ac) {
  return ab.left == bc.left && ab.left != ac.left && ab.e + bc.e - ac.e != 0.0;
}
// Depth and scalar where the ray crosses a triangle; the weights keep a constant constant.
vec2 crossingOf(vec2 a, vec2 b, vec2 c, Edge ab, Edge bc, Edge ac) {
  precise float d = ab.e + bc.e - ac.e;
  precise float wb = -ac.e / d;
  precise float wc = ab.e / d;
  precise vec2 at = a + wb * (b - a) + wc * (c - a);
  return at;
}
const float none = 3.0e38;
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
#ifdef THIN
    vec3 w = segmentThinWeights(a.a * l, b.a * l);
#else
    vec3 w = segmentWeights(a.a * l, b.a * l);
#endif
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

// Whatever the blending does, fragments keep the larger (GlCompositor::draw).
constexpr const char* peak_cell = R"(
vec4 segment(float front, float back, float len) {
  return vec4(max(front, back), 0.0, 0.0, 1.0);
}
)";
constexpr const char* constant_peak_cell = R"(
flat in vec4 paint;
vec4 segment(float front, float back, float len) {
  return vec4(paint.r, 0.0, 0.0, 1.0);
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
void main() {
  vec2 p = gl_FragCoord.xy + pixel.xy;
  Corner a = corner(v0, p);
  Corner b = corner(v1, p);
  Corner c = corner(v2, p);
  Corner d = corner(v3, p);
  Edge ab = edge(a, b);
  Edge ac = edge(a, c);
  Edge ad = edge(a, d);
  Edge bc = edge(b, c);
  Edge bd = edge(b, d);
  Edge cd = edge(c, d);
  vec2 front = vec2(none, 0.0);
  vec2 back = vec2(-none, 0.0);
#define MEET(A, B, C, AB, BC, AC)                 \
  {                                               \
    bool hit = crossed(AB, BC, AC);               \
    vec2 q = crossingOf(A.q, B.q, C.q, AB, BC, AC); \
    front = hit && q.x < front.x ? q : front;     \
    back = hit && q.x > back.x ? q : back;        \
  }
  MEET(a, b, c, ab, bc, ac)
  MEET(a, b, d, ab, bd, ad)
  MEET(a, c, d, ac, cd, ad)
  MEET(b, c, d, bc, cd, bd)
  if (!(back.x > front.x)) discard;
  radiance = interval(p, front, back);
  if (radiance.a == 0.0) discard;
}
)";

// The crossings of a cell that need not be convex, by repeated sweeps from the front: a ray seldom crosses more than
// two triangles, which one sweep finds, and there is no bound on how many to make room for.
constexpr const char* sweep = R"(
struct Crossing { vec2 q; int i; };
struct Sweep {
  Crossing last;  // looked at: what lies behind this, by depth, then by number
  Crossing next, farthest;
  int count;
};
void visit(inout Sweep w, bool hit, vec2 q, int i) {
  bool behind = hit && (q.x > w.last.q.x || (q.x == w.last.q.x && i > w.last.i));
  bool nearer = behind && q.x < w.next.q.x;
  bool farther = behind && q.x >= w.farthest.q.x;
  w.count += behind ? 1 : 0;
  w.next.q = nearer ? q : w.next.q;
  w.next.i = nearer ? i : w.next.i;
  w.farthest.q = farther ? q : w.farthest.q;
}
)";

// Three corners of a triangle at a time, from the cell's list.
constexpr const char* any_sweep = R"(
void sweepCell(inout Sweep w, vec2 p) {
  for (int i = 0; i < int(at.z); ++i) {
    uint corners = texelFetch(triangles, int(at.y) + i).x;
    Corner a = corner(texelFetch(vertices, int(at.x + (corners & 1023u))), p);
    Corner b = corner(texelFetch(vertices, int(at.x + ((corners >> 10) & 1023u))), p);
    Corner c = corner(texelFetch(vertices, int(at.x + (corners >> 20))), p);
    Edge ab = edge(a, b);
    Edge bc = edge(b, c);
    Edge ac = edge(a, c);
    visit(w, crossed(ab, bc, ac), crossingOf(a.q, b.q, c.q, ab, bc, ac), i);
  }
}
)";

// Eight corners with the faces of a hexahedron; a pyramid, wedge or tetrahedron has several corners in one place, and
// triangles without area, which no ray crosses.
constexpr const char* hexahedron_sweep = R"(
flat in vec4 v0;
flat in vec4 v1;
flat in vec4 v2;
flat in vec4 v3;
flat in vec4 v4;
flat in vec4 v5;
flat in vec4 v6;
flat in vec4 v7;
Corner choose(bool second, Corner a, Corner b) {
  return Corner(second ? b.xy : a.xy, second ? b.h : a.h, second ? b.q : a.q);
}
Edge choose(bool second, Edge a, Edge b) {
  return Edge(second ? b.e : a.e, second ? b.left : a.left);
}
Edge back(Edge a) {
  return Edge(-a.e, !a.left);
}
// A face a, b, c, d, cut from a to c, or, when its bit of at.y is set, from b to d.
void visitFace(inout Sweep w, int i, Corner a, Corner b, Corner c, Corner d, Edge ab, Edge bc, Edge cd, Edge da) {
  bool turned = ((at.y >> i) & 1u) != 0u;
  Corner k = choose(turned, a, b);
  Corner l = choose(turned, b, c);
  Corner m = choose(turned, c, d);
  Corner n = choose(turned, d, a);
  Edge kl = choose(turned, ab, bc);
  Edge lm = choose(turned, bc, cd);
  Edge mn = choose(turned, cd, da);
  Edge kn = back(choose(turned, da, ab));
  Edge km = edge(k, m);
  visit(w, crossed(kl, lm, km), crossingOf(k.q, l.q, m.q, kl, lm, km), 2 * i);
  visit(w, crossed(km, mn, kn), crossingOf(k.q, m.q, n.q, km, mn, kn), 2 * i + 1);
}
void sweepCell(inout Sweep w, vec2 p) {
  Corner a = corner(v0, p);
  Corner b = corner(v1, p);
  Corner c = corner(v2, p);
  Corner d = corner(v3, p);
  Corner e = corner(v4, p);
  Corner f = corner(v5, p);
  Corner g = corner(v6, p);
  Corner h = corner(v7, p);
  Edge ab = edge(a, b);
  Edge bc = edge(b, c);
  Edge cd = edge(c, d);
  Edge ad = edge(a, d);
  Edge ef = edge(e, f);
  Edge fg = edge(f, g);
  Edge gh = edge(g, h);
  Edge eh = edge(e, h);
  Edge ae = edge(a, e);
  Edge bf = edge(b, f);
  Edge cg = edge(c, g);
  Edge dh = edge(d, h);
  visitFace(w, 0, a, e, h, d, ae, eh, back(dh), back(ad));
  visitFace(w, 1, b, c, g, f, bc, cg, back(fg), back(bf));
  visitFace(w, 2, a, b, f, e, ab, bf, back(ef), back(ae));
  visitFace(w, 3, d, h, g, c, dh, back(gh), back(cg), cd);
  visitFace(w, 4, a, d, c, b, ad, back(cd), back(bc), back(ab));
  visitFace(w, 5, e, f, g, h, ef, fg, gh, back(eh));
}
)";

constexpr const char* sweep_main = R"(
void main() {
  vec2 p = gl_FragCoord.xy + pixel.xy;
  Crossing before = Crossing(vec2(-none, 0.0), -1);
  vec2 entry = vec2(0.0);
  bool inside = false;
  vec4 sum = vec4(0.0);
  for (bool done = false; !done;) {
    Sweep w = Sweep(before, Crossing(vec2(none, 0.0), 0), Crossing(vec2(-none, 0.0), 0), 0);
    sweepCell(w, p);
    bool pair = !inside && w.count == 2;  // both ends of the last interval at once
    done = pair || w.count == 0 || (!inside && w.count < 2);
    entry = inside ? entry : w.next.q;
    vec2 exit = pair ? w.farthest.q : w.next.q;
#ifdef PEAKS
    if (pair || (inside && w.count > 0)) sum = max(sum, interval(p, entry, exit));
#else
    if (pair || (inside && w.count > 0)) sum += (1.0 - sum.a) * interval(p, entry, exit);
#endif
    before = w.next;
    inside = !inside;
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
    case SegmentShader::peak:
      return peak_cell;
    case SegmentShader::constant_peak:
      return constant_peak_cell;
    case SegmentShader::exact:
      break;
  }
  return linear_cell;
}

std::string header(const CellShader& shader) {
  std::string text = declarations;
  text += "#define CORNERS " + std::to_string(shader.shape == CellShape::any          ? 0
                                              : shader.shape == CellShape::tetrahedra ? 4
                                                                                      : 8);
  text += '\n';
  if (shader.segment == SegmentShader::constant || shader.segment == SegmentShader::constant_peak) {
    text += "#define CELL_FIELD\n";
  }
  if (shader.segment == SegmentShader::peak || shader.segment == SegmentShader::constant_peak) {
    text += "#define PEAKS\n";
  }
  if (shader.thin) {
    text += "#define THIN\n";
  }
  return text;
}

std::string mainText(CellShape shape) {
  if (shape == CellShape::tetrahedra) {
    return tetrahedron_main;
  }
  return std::string(sweep) + (shape == CellShape::hexahedra ? hexahedron_sweep : any_sweep) + sweep_main;
}

}  // namespace

std::string cellVertexShader(const CellShader& shader) {
  return header(shader) + vertex_main;
}

std::string cellFragmentShader(const CellShader& shader) {
  return header(shader) + integrate::segment_glsl + crossing + trimming + transfer_lookup +
         segmentText(shader.segment) + fragment_common + mainText(shader.shape);
}

std::string polygonVertexShader() {
  return std::string(declarations) + polygon_vertex_main;
}

std::string polygonFragmentShader() {
  return std::string(declarations) + polygon_fragment_main;
}

}  // namespace spillikin::composite
