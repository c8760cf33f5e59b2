#include "spillikin/render/session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <oneapi/tbb/task_group.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <glm/geometric.hpp>
#include <optional>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/composite/clear_cells.h"
#include "spillikin/mesh/folded.h"
#include "spillikin/mesh/refit.h"
#include "spillikin/mesh/subdivide.h"
#include "spillikin/project/camera.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/memory.h"
#include "spillikin/render/optics.h"
#include "spillikin/sort/convexified.h"
#include "spillikin/sort/convexity.h"

namespace spillikin::render {

namespace {

class Clock {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Of `cells`, those that are listed in more than one piece.
std::size_t subdividedCells(const sort::Order& order, std::size_t cells) {
  if (order.cuts.empty()) return 0;
  std::vector<bool> cut(cells, false);
  for (std::size_t i = 0; i < order.cuts.size(); ++i)
    cut[order.cells[order.cuts[i].entry]] = true;
  return static_cast<std::size_t>(std::count(cut.begin(), cut.end(), true));
}

}  // namespace

const char* name(Projection projection) {
  switch (projection) {
    case Projection::automatic:
      return "auto";
    case Projection::zoo:
      return "zoo";
    case Projection::tets:
      return "tets";
  }
  return "?";
}

Projection projection(std::string_view text) {
  for (const Projection p : {Projection::automatic, Projection::zoo, Projection::tets}) {
    if (text == name(p)) return p;
  }
  throw Error(fmt::format("no projection is called '{}'; there are auto, zoo, tets", text));
}

struct ThreadLimit::Impl {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads)
    : impl_(threads > 0 ? new Impl{{tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)}}
                        : nullptr) {}

ThreadLimit::~ThreadLimit() = default;

int ThreadLimit::current() {
  const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::min(static_cast<int>(allowed), tbb::info::default_concurrency());
}

// Which order a frame is composited in: one found by the engine's algorithm; a quick one behind a certificate; or,
// where no order shows, that of the file.
enum class Road : std::uint8_t { order, certificate, file };

// A sorter and its order of the current view.
struct Sorted {
  std::unique_ptr<sort::Sorter> sorter;
  sort::Order order;
  bool ordered = false;
  double seconds = 0.0, prepare_seconds = 0.0;
};

struct Session::Impl {
  Engine engine;
  Clock clock;
  Stats stats;
  std::vector<std::string> warnings;

  // Tiers (a), (b).
  mesh::Source source;
  mesh::BuildReport report;
  mesh::Mesh mesh;
  std::uint64_t topology = 0;
  std::optional<mesh::Tetrahedralization> tets;
  Sorted asked;                              // by the algorithm of the engine
  Sorted quick;                              // behind a certificate
  Sorted file;                               // where no order shows
  std::optional<sort::Convexity> convexity;  // of the drawn mesh, once asked for
  double extent = 0.0;                       // of the mesh, its diagonal
  bool crowded = false;                      // too many pixels had to be sorted again
  bool lost = false;                         // rays that walk through the mesh lose their way
  double mesh_bytes = 0.0, walk_bytes = 0.0;
  // Tier (c).
  View view;
  std::optional<project::Camera> camera;
  // Tier (d).
  mesh::Field field;
  std::optional<mesh::Field> tet_field;
  // Tier (e).
  integrate::TransferFunction transfer_function;
  integrate::Optics optics = integrate::Optics::absorption_emission;
  std::optional<Rendition> rendition;  // of the two, once drawn

  std::unique_ptr<composite::Compositor> compositor;
  bool drew_topology = false, drew_mesh = false, drew_field = false, drew_transfer_function = false;
  std::vector<std::uint8_t> clear;  // of the three that were drawn, see composite::Frame

  const mesh::Mesh& drawnMesh();
  const mesh::Field& drawnField();
  const Rendition& drawnLook();
  void findClearCells();
  void build();
  void newGeometry();
  void warnOfFolds();
  void chooseCompositor();
  bool certificateWillDo();
  Road road();
  void keep(Sorted& sorted, std::unique_ptr<sort::Sorter> sorter, const Clock& since);
  Sorted& sorter(Road road);
  Sorted& sort(Road road);
  void sortAndPrepare(Road road, const composite::Frame& frame);
  composite::Frame frame(const sort::Order& order);
  bool walk(Image& image);
  void drawInOrder(Image& image);
  void record(const composite::FrameStats& drawn);
  void warn(std::string line);
  std::string called() const { return mesh.name.empty() ? "the mesh" : mesh.name; }
};

void Session::Impl::warn(std::string line) {
  for (const std::string& known : warnings) {
    if (known == line) return;
  }
  warnings.push_back(std::move(line));
}

void Session::Impl::build() {
  const Clock timer;
  mesh = mesh::build(source, &report);
  drew_topology = false;
  for (const std::string& line : report.warnings)
    warn(line);
  const mesh::Counts counts = mesh::count(mesh);
  mesh_bytes = static_cast<double>(counts.bytes);
  newGeometry();
  warnOfFolds();
  stats.build_seconds = timer.seconds();
  stats.adjacency_reused = false;
  stats.cells = mesh.cell_count();
  stats.cells_by_type.clear();
  for (std::size_t t = 0; t < mesh::cell_type_count; ++t) {
    if (counts.cells_by_type[t] == 0) continue;
    stats.cells_by_type[mesh::name(static_cast<mesh::CellType>(t))] = counts.cells_by_type[t];
  }
  stats.faces = mesh.face_count();
  stats.exterior_faces = counts.exterior_faces;
}

// Cells whose faces cross each other have no picture: said with the file's ids of the first few.
void Session::Impl::warnOfFolds() {
  constexpr std::size_t named = 8;
  const std::vector<mesh::Id> folded = mesh::foldedCells(mesh);
  if (folded.empty()) return;
  std::vector<mesh::Id> ids;
  ids.reserve(folded.size());
  for (const mesh::Id cell : folded)
    ids.push_back(mesh.cell_file_id[cell]);
  std::sort(ids.begin(), ids.end());
  const bool more = ids.size() > named;
  ids.resize(std::min(ids.size(), named));
  warn(
      fmt::format("{}: {} folded cell{}, whose faces cross each other so that they overlap; where they lie the picture "
                  "means nothing: cell{} {}{}",
                  called(), folded.size(), folded.size() == 1 ? "" : "s", ids.size() == 1 ? "" : "s",
                  fmt::join(ids, ", "), more ? ", ..." : ""));
}

// What was made of the places of the vertices is made again.
void Session::Impl::newGeometry() {
  // An empty list in place of these vectors would empty them and keep their memory.
  source.connectivity = decltype(source.connectivity)();
  source.offsets = decltype(source.offsets)();
  tets.reset();
  tet_field.reset();
  asked = {};
  quick = {};
  file = {};
  rendition.reset();
  convexity.reset();
  crowded = lost = false;
  walk_bytes = 0.0;
  stats.bytes_per_cell = mesh_bytes / static_cast<double>(mesh.cell_count());
  drew_mesh = drew_field = false;
}

const mesh::Mesh& Session::Impl::drawnMesh() {
  if (engine.projection != Projection::tets || mesh.tetrahedral()) return mesh;
  if (!tets) {
    tets = mesh::tetrahedralize(mesh);
    if (!tets->unfilled.empty()) {
      warn(fmt::format(
          "{}: {} cells cannot be cut into tetrahedra that fill them, the first is cell {}; draw them whole "
          "(--project zoo)",
          called(), tets->unfilled.size(), mesh.cell_file_id[tets->unfilled.front()]));
    }
  }
  return tets->mesh;
}

// The field of the tetrahedra: vertices are those of the mesh, cells inherit from the cell they were cut from.
const mesh::Field& Session::Impl::drawnField() {
  if (&drawnMesh() == &mesh) return field;
  if (tet_field) return *tet_field;
  tet_field = mesh::tetrahedraField(*tets, field);
  return *tet_field;
}

const Rendition& Session::Impl::drawnLook() {
  if (!rendition) {
    const Box box = boundingBox(mesh);
    rendition = render::rendition(optics, transfer_function, glm::length(box.upper - box.lower));
  }
  return *rendition;
}

// Other integrations than the exact one may take a cell's scalars from a little beyond it; a peak shows anyway.
void Session::Impl::findClearCells() {
  if (drew_mesh && drew_field && drew_transfer_function) return;
  clear = {};
  stats.composite.clear_cells = 0;
  if (engine.integration != composite::Integration::exact || drawnLook().peaks) return;
  clear = composite::clearCells(drawnMesh(), drawnField(), drawnLook().look);
  stats.composite.clear_cells = clear.size() - static_cast<std::size_t>(std::count(clear.begin(), clear.end(), 0));
}

void Session::Impl::chooseCompositor() {
  if (compositor) return;
  // The native compositor integrates exactly or not at all; the hardware's approximations are OpenGL's.
  const bool approximate = engine.integration != composite::Integration::exact;
  const bool choose = engine.backend == composite::Backend::automatic && approximate;
  compositor = composite::makeCompositor(choose ? composite::Backend::osmesa : engine.backend);
}

// Whether a quick order and the certificate lead to the same picture as an exact order, and sooner. The exact orders of
// convex meshes are as quick; across gaps they cost several times as much. A look so dense that a fragment too short
// for the certificate shows, and a mesh on which the quick order was wrong on many pixels, take the exact order.
bool Session::Impl::certificateWillDo() {
  constexpr double hidden_light = 1e-3;  // what one overlooked fragment may absorb: a quarter of a display step
  const double grain = compositor->certificateGrain();
  if (engine.sort != sort::Algorithm::automatic || grain <= 0.0 || crowded) return false;
  if (!convexity) {
    const Box box = boundingBox(mesh);
    extent = glm::length(box.upper - box.lower);
    convexity = sort::convexity(drawnMesh(), sort::exteriorTriangles(drawnMesh()));
    const Clock timer;
    if (!convexity->convex && !asked.sorter) keep(asked, sort::Convexified::withoutFilling(drawnMesh()), timer);
  }
  const bool gaps = !convexity->convex && !(asked.sorter && asked.sorter->algorithm() == sort::Algorithm::convexified);
  return gaps && transfer_function.densest() * extent * grain <= hidden_light;
}

Road Session::Impl::road() {
  if (engine.sort == sort::Algorithm::automatic && !drawnLook().order_matters) return Road::file;
  return certificateWillDo() ? Road::certificate : Road::order;
}

void Session::Impl::keep(Sorted& sorted, std::unique_ptr<sort::Sorter> sorter, const Clock& since) {
  if (!sorter) return;
  sorted.sorter = std::move(sorter);
  sorted.prepare_seconds = since.seconds();
  stats.bytes_per_cell += static_cast<double>(sorted.sorter->bytes()) / static_cast<double>(mesh.cell_count());
}

Sorted& Session::Impl::sorter(Road road) {
  Sorted& s = road == Road::certificate ? quick : road == Road::file ? file : asked;
  if (crowded) quick = {};  // not asked for again until the mesh changes
  if (!s.sorter) {
    const Clock timer;
    const sort::Algorithm algorithm = road == Road::certificate ? sort::Algorithm::mpvonc
                                      : road == Road::file      ? sort::Algorithm::none
                                                                : engine.sort;
    keep(s, sort::makeSorter(algorithm, drawnMesh(), sort::CurvedCells::cut, convexity ? &*convexity : nullptr), timer);
  }
  return s;
}

Sorted& Session::Impl::sort(Road road) {
  Sorted& s = sorter(road);
  if (!s.ordered) {
    const Clock timer;
    s.order.problems = {};
    (*s.sorter)(viewpoint(view), s.order);
    s.ordered = true;
    s.seconds = timer.seconds();
  }
  stats.sort.prepare_seconds = s.prepare_seconds;
  stats.sort.seconds = s.seconds;
  stats.sort.algorithm = sort::name(s.sorter->algorithm());
  stats.sort.cells_per_second = static_cast<double>(s.order.cells.size()) / std::max(s.seconds, 1e-9);
  stats.sort.cycles = s.order.cycles.size();
  stats.sort.problems_known = s.order.problems.known;
  stats.sort.problem_faces = s.order.problems.faces;
  stats.sort.problem_cells = s.order.problems.cells;
  stats.sort.subdivided_cells = subdividedCells(s.order, drawnMesh().cell_count());
  stats.sort.exact = s.order.exact;
  stats.sort.road = road == Road::certificate ? "certificate" : "order";
  stats.sort.why = road == Road::certificate
                       ? "the mesh is not convex, and the compositor finds and sorts again every pixel on "
                         "which this order, quicker than an exact one, is wrong"
                       : sort::why(*s.sorter, s.order);
  return s;
}

// A sort leaves cores idle while it works on one; what of the frame needs no order is done there meanwhile. Not
// before: it would take the cores from the sort's own passes.
void Session::Impl::sortAndPrepare(Road road, const composite::Frame& frame) {
  tbb::task_group beside;
  bool started = false;
  const auto start = [&] {
    if (!std::exchange(started, true)) beside.run([&] { compositor->prepare(frame); });
  };
  sort::Sorter& asks = *sorter(road).sorter;
  if (!asks.whileSerial(start)) start();
  try {
    sort(road);
    asks.whileSerial({});
    start();
  } catch (...) {
    asks.whileSerial({});
    beside.cancel();
    beside.wait();
    throw;
  }
  beside.wait();
}

// What is drawn now, in `order`, which may be made later.
composite::Frame Session::Impl::frame(const sort::Order& order) {
  const Rendition& look = drawnLook();
  return {.mesh = drawnMesh(),
          .field = drawnField(),
          .transfer_function = look.look,
          .camera = *camera,
          .order = order,
          .integration = engine.integration,
          .same_mesh = drew_mesh,
          .same_topology = drew_topology && &drawnMesh() == &mesh,
          .same_field = drew_field,
          .same_transfer_function = drew_transfer_function,
          .order_matters = look.order_matters,
          .walking = engine.walking,
          .peaks = look.peaks,
          .clear = clear};
}

// False where the picture has to be drawn in an order.
bool Session::Impl::walk(Image& image) {
  if (engine.sort != sort::Algorithm::automatic || lost) return false;
  static const sort::Order none;
  composite::Frame unordered = frame(none);
  if (compositor->needsOrder(unordered)) return false;
  unordered.ordered = false;
  const composite::FrameStats drawn = compositor->draw(unordered, image);
  lost = !drawn.certified;
  if (lost) return false;
  stats.sort = {};
  stats.sort.algorithm = sort::name(sort::Algorithm::none);
  stats.sort.exact = true;
  stats.sort.road = "walk";
  stats.bytes_per_cell += (static_cast<double>(drawn.kept_bytes) - walk_bytes) / static_cast<double>(mesh.cell_count());
  walk_bytes = static_cast<double>(drawn.kept_bytes);
  stats.sort.why = "cells are so small on the screen that rays walk from one to the next, and need no order";
  record(drawn);
  return true;
}

void Session::Impl::drawInOrder(Image& image) {
  constexpr double crowd = 0.01;  // of the image's pixels: repairing more costs about as much as an exact order
  const Road way = road();
  const Sorted& sorted = sorter(way);
  const composite::Frame ordered = frame(sorted.order);
  sortAndPrepare(way, ordered);
  if (!ordered.order_matters) {
    stats.sort.exact = true;
    stats.sort.why = "under this look and these optics no order shows";
  }
  const composite::FrameStats drawn = compositor->draw(ordered, image);
  record(drawn);
  if (way == Road::certificate) crowded = static_cast<double>(drawn.flagged) > crowd * view.width * view.height;
  const bool certified = drawn.certified && drawn.unresolved == 0;
  if (ordered.order_matters && !sorted.order.exact && !certified && way == Road::order) {
    warn(fmt::format("{}: the order may be wrong on some pixels: {}", called(), stats.sort.why));
  }
  if (drawn.unresolved > 0) {
    warn(fmt::format(
        "{}: on {} pixels cells overlap in space, where no order is right; spillikin sort --verify names them",
        called(), drawn.unresolved));
  }
}

void Session::Impl::record(const composite::FrameStats& drawn) {
  stats.project.seconds = drawn.project_seconds;
  stats.composite.backend = composite::name(compositor->backend());
  stats.composite.integration = composite::name(engine.integration);
  stats.composite.seconds = drawn.composite_seconds;
  stats.composite.fragments = drawn.fragments;
  stats.certificate = {drawn.certified || drawn.flagged + drawn.unresolved > 0, drawn.flagged, drawn.resolved,
                       drawn.unresolved};
  stats.total_seconds = stats.load_seconds + clock.seconds();
  stats.peak_rss_bytes = peakResidentBytes();
  stats.threads = ThreadLimit::current();
}

Session::Session(mesh::Source source, const Engine& engine) : impl_(std::make_unique<Impl>()) {
  impl_->engine = engine;
  setSource(std::move(source));
  setView(defaultView());
  setField("");
  setTransferFunction(defaultTransferFunction());
}

Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

void Session::setSource(mesh::Source source) {
  Impl& s = *impl_;
  const Clock timer;
  const std::uint64_t topology = mesh::topologyFingerprint(source);
  s.source = std::move(source);
  s.warnings.clear();
  const bool same = topology == s.topology && s.mesh.cell_count() > 0;
  if (same && mesh::refit(s.mesh, s.report, s.source)) {
    s.mesh.name = s.source.name;
    for (const std::string& line : s.report.warnings)
      s.warn(line);
    s.newGeometry();
    s.warnOfFolds();
    s.stats.build_seconds = timer.seconds();
    s.stats.adjacency_reused = true;
    return;
  }
  s.topology = topology;
  s.build();
}

void Session::setView(const View& view) {
  impl_->camera.emplace(view);
  impl_->view = view;
  impl_->asked.ordered = impl_->quick.ordered = impl_->file.ordered = false;
}

void Session::setField(const std::string& name, int component) {
  const Clock timer;
  impl_->field = mesh::selectField(impl_->source, impl_->mesh, name, component);
  impl_->tet_field.reset();
  impl_->drew_field = false;
  impl_->stats.field_seconds = timer.seconds();
  const mesh::Field& field = impl_->field;
  if (field.hidden_count > 0) {
    impl_->warn(fmt::format("array '{}': {} of {} cells have a value that is not finite and are left out", field.name,
                            field.hidden_count, impl_->mesh.cell_count()));
  }
}

void Session::setTransferFunction(integrate::TransferFunction transfer_function) {
  impl_->transfer_function = std::move(transfer_function);
  impl_->rendition.reset();
  impl_->drew_transfer_function = false;
}

void Session::setOptics(integrate::Optics optics) {
  impl_->optics = optics;
  impl_->rendition.reset();
  impl_->drew_transfer_function = false;
}

View Session::defaultView(int width, int height) const {
  View view;
  view.width = width;
  view.height = height;
  placeEye(view, boundingBox(impl_->mesh), {});
  return view;
}

integrate::TransferFunction Session::defaultTransferFunction() const {
  return typicalLook(impl_->mesh, impl_->field, integrate::default_preset);
}

void Session::draw(Image& image) {
  Impl& s = *impl_;
  const std::size_t pixels = static_cast<std::size_t>(s.view.width) * static_cast<std::size_t>(s.view.height);
  if (image.rgba.size() < 4 * pixels) requireImageMemory(s.view, availableBytes());
  s.chooseCompositor();
  s.findClearCells();
  if (!s.walk(image)) s.drawInOrder(image);
  develop(s.drawnLook(), image);
  s.drew_topology = s.drew_mesh = s.drew_field = s.drew_transfer_function = true;
}

Image Session::draw() {
  Image image;
  draw(image);
  return image;
}

const sort::Order& Session::order() {
  return impl_->sort(Road::order).order;
}

const mesh::Source& Session::source() const {
  return impl_->source;
}
const mesh::Mesh& Session::mesh() const {
  return impl_->mesh;
}
const mesh::BuildReport& Session::buildReport() const {
  return impl_->report;
}
const mesh::Field& Session::field() const {
  return impl_->field;
}
const View& Session::view() const {
  return impl_->view;
}
const integrate::TransferFunction& Session::transferFunction() const {
  return impl_->transfer_function;
}
integrate::Optics Session::optics() const {
  return impl_->optics;
}
const mesh::Mesh& Session::drawnMesh() {
  return impl_->drawnMesh();
}
const mesh::Field& Session::drawnField() {
  return impl_->drawnField();
}
const std::vector<mesh::Id>& Session::parent() const {
  static const std::vector<mesh::Id> itself;
  return impl_->tets ? impl_->tets->parent : itself;
}
void Session::setLoadSeconds(double seconds) {
  impl_->stats.load_seconds = seconds;
}
const Stats& Session::stats() const {
  return impl_->stats;
}
const std::vector<std::string>& Session::warnings() const {
  return impl_->warnings;
}

Image render(const mesh::Source& source, const View& view, const integrate::TransferFunction& transfer_function,
             const Engine& engine) {
  Session session(source, engine);
  session.setView(view);
  session.setTransferFunction(transfer_function);
  return session.draw();
}

}  // namespace spillikin::render
