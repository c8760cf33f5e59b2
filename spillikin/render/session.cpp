#include "spillikin/render/session.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "spillikin/base/error.h"
#include "spillikin/mesh/refit.h"
#include "spillikin/mesh/subdivide.h"
#include "spillikin/project/camera.h"
#include "spillikin/render/defaults.h"

namespace spillikin::render {

namespace {

class Clock {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

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
  std::unique_ptr<sort::Sorter> sorter;
  // Tier (c).
  View view;
  std::optional<project::Camera> camera;
  sort::Order order;
  bool ordered = false;
  // Tier (d).
  mesh::Field field;
  std::optional<mesh::Field> tet_field;
  // Tier (e).
  integrate::TransferFunction transfer_function;

  std::unique_ptr<composite::Compositor> compositor;
  bool drew_mesh = false, drew_field = false, drew_transfer_function = false;

  const mesh::Mesh& drawnMesh();
  const mesh::Field& drawnField();
  void build();
  void newGeometry();
  void sort();
  void warn(std::string line);
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
  for (const std::string& line : report.warnings)
    warn(line);
  newGeometry();
  stats.build_seconds = timer.seconds();
  stats.adjacency_reused = false;
  const mesh::Inspection inspection = mesh::inspect(mesh);
  stats.cells = mesh.cell_count();
  stats.cells_by_type.clear();
  for (std::size_t t = 0; t < mesh::cell_type_count; ++t) {
    if (inspection.cells_by_type[t] == 0) continue;
    stats.cells_by_type[mesh::name(static_cast<mesh::CellType>(t))] = inspection.cells_by_type[t];
  }
  stats.faces = mesh.face_count();
  stats.exterior_faces = inspection.exterior_faces;
  stats.bytes_per_cell = static_cast<double>(inspection.bytes) / static_cast<double>(mesh.cell_count());
}

// What was made of the places of the vertices is made again.
void Session::Impl::newGeometry() {
  source.connectivity = {};
  source.offsets = {};
  tets.reset();
  tet_field.reset();
  sorter.reset();
  ordered = false;
  drew_mesh = drew_field = false;
}

const mesh::Mesh& Session::Impl::drawnMesh() {
  if (engine.projection != Projection::tets || mesh.tetrahedral()) return mesh;
  if (!tets) tets = mesh::tetrahedralize(mesh);
  return tets->mesh;
}

// The field of the tetrahedra: vertices are those of the mesh, cells inherit from the cell they were cut from.
const mesh::Field& Session::Impl::drawnField() {
  if (&drawnMesh() == &mesh) return field;
  if (tet_field) return *tet_field;
  tet_field = field;
  const auto inherit = [&](const auto& from, auto& to) {
    to.resize(tets->parent.size());
    for (std::size_t t = 0; t < to.size(); ++t)
      to[t] = from[tets->parent[t]];
  };
  if (field.association == mesh::Association::cells) inherit(field.values, tet_field->values);
  if (!field.hidden.empty()) inherit(field.hidden, tet_field->hidden);
  return *tet_field;
}

void Session::Impl::sort() {
  if (!sorter) {
    const Clock timer;
    sorter = sort::makeSorter(engine.sort, drawnMesh());
    stats.sort.prepare_seconds = timer.seconds();
    stats.bytes_per_cell += static_cast<double>(sorter->bytes()) / static_cast<double>(mesh.cell_count());
  }
  if (ordered) return;
  const Clock timer;
  (*sorter)(viewpoint(view), order);
  ordered = true;
  stats.sort.seconds = timer.seconds();
  stats.sort.algorithm = sort::name(sorter->algorithm());
  stats.sort.cells_per_second = static_cast<double>(order.cells.size()) / std::max(stats.sort.seconds, 1e-9);
  stats.sort.cycles = order.cycles.size();
  stats.sort.exact = order.exact;
  stats.sort.why = sort::why(*sorter, order);
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
  impl_->ordered = false;
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
  const mesh::Field& field = impl_->field;
  const auto look = integrate::preset(integrate::default_preset).mapped(field.lo, field.hi);
  return look.scaled(extinctionFactor(impl_->mesh, field, look));
}

Image Session::draw() {
  Impl& s = *impl_;
  s.sort();
  if (!s.compositor) {
    // The native compositor integrates exactly or not at all; the hardware's approximations are OpenGL's.
    const bool approximate = s.engine.integration != composite::Integration::exact;
    const bool choose = s.engine.backend == composite::Backend::automatic && approximate;
    s.compositor = composite::makeCompositor(choose ? composite::Backend::osmesa : s.engine.backend);
  }
  Image image;
  const composite::Frame frame{s.drawnMesh(), s.drawnField(), s.transfer_function,
                               *s.camera,     s.order,        s.engine.integration,
                               s.drew_mesh,   s.drew_field,   s.drew_transfer_function};
  const composite::FrameStats drawn = s.compositor->draw(frame, image);
  s.drew_mesh = s.drew_field = s.drew_transfer_function = true;
  s.stats.project.seconds = drawn.project_seconds;
  s.stats.composite.backend = composite::name(s.compositor->backend());
  s.stats.composite.integration = composite::name(s.engine.integration);
  s.stats.composite.seconds = drawn.composite_seconds;
  s.stats.composite.fragments = drawn.fragments;
  s.stats.certificate = {drawn.certified || drawn.flagged + drawn.unresolved > 0, drawn.flagged, drawn.resolved,
                         drawn.unresolved};
  s.stats.total_seconds = s.stats.load_seconds + s.clock.seconds();
  s.stats.peak_rss_bytes = peakResidentBytes();
  s.stats.threads = ThreadLimit::current();
  const bool certified = drawn.certified && drawn.unresolved == 0;
  if (!s.order.exact && !certified) {
    s.warn(fmt::format("{}: the order may be wrong on some pixels: {}", s.mesh.name.empty() ? "the mesh" : s.mesh.name,
                       s.stats.sort.why));
  }
  if (drawn.unresolved > 0) {
    s.warn(fmt::format(
        "{}: on {} pixels cells overlap in space, where no order is right; spillikin sort --verify names them",
        s.mesh.name.empty() ? "the mesh" : s.mesh.name, drawn.unresolved));
  }
  return image;
}

const sort::Order& Session::order() {
  impl_->sort();
  return impl_->order;
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
