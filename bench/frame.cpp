#include "bench/frame.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>

#include "bench/meter.h"
#include "spillikin/base/error.h"
#include "spillikin/render/defaults.h"
#include "spillikin/render/session.h"
#include "spillikin/sort/sort.h"
#include "tests/support/meshes.h"

namespace spillikin::bench {

namespace {

using Json = nlohmann::ordered_json;

constexpr double degrees_per_frame = 4.0;
constexpr double degrees_of_small_move = 0.05;

template <class T>
std::size_t bytesOf(const std::vector<T>& v) {
  return v.size() * sizeof(T);
}

std::size_t bytesOf(const mesh::Source& s) {
  std::size_t sum = bytesOf(s.points) + bytesOf(s.types) + bytesOf(s.offsets) + bytesOf(s.connectivity);
  for (const auto& array : s.arrays)
    sum += bytesOf(array.values);
  return sum;
}

// The least that a frame has to move: every array that sorting and drawing need, once; the order and the picture.
std::size_t leastBytes(const mesh::Mesh& m, const mesh::Field& f, int size) {
  return bytesOf(m.points) + bytesOf(f.values) + bytesOf(m.cell_vertex) + bytesOf(m.cell_face) + bytesOf(m.triangle) +
         bytesOf(m.triangle_cells) + 2 * sizeof(mesh::Id) * m.cell_count() +
         4 * sizeof(float) * static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
}

// The peak of resident memory is counted from here on (Linux; elsewhere from the start of the process).
void forgetPeak() {
  std::ofstream("/proc/self/clear_refs") << "5";
}

std::size_t peakBytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::size_t kilobytes = 0;
    if (word == "VmHWM:" && status >> kilobytes) return kilobytes * 1024;
  }
  return render::peakResidentBytes();
}

struct Stages {
  Frames frame;
  std::vector<double> sort, project, composite;
};

Stages draw(render::Session& session, View& view, int frames, double degrees) {
  Stages s;
  Image image;
  session.draw(image);
  for (int i = 0; i < frames; ++i) {
    render::turnView(view, {degrees, 0.0, 1.0});
    s.frame.add(spentOn([&] {
      session.setView(view);
      session.draw(image);
    }));
    s.sort.push_back(session.stats().sort.seconds);
    s.project.push_back(session.stats().project.seconds);
    s.composite.push_back(session.stats().composite.seconds);
  }
  return s;
}

// Orders alone, of the sorters that the report follows over all sizes.
Json sortRates(const mesh::Mesh& mesh, View view, int frames) {
  Json j;
  sort::Order order;
  for (const sort::Algorithm a : {sort::Algorithm::mpvo, sort::Algorithm::power, sort::Algorithm::centroid}) {
    const auto sorter = sort::makeSorter(a, mesh);
    Frames times;
    for (int i = 0; i <= frames; ++i) {
      render::turnView(view, {degrees_per_frame, 0.0, 1.0});
      const Spent spent = spentOn([&] { (*sorter)(viewpoint(view), order); });
      if (i > 0) times.add(spent);
    }
    j[sort::name(a)] = {{"seconds", median(times.wall)}, {"bytes", sorter->bytes()}};
  }
  return j;
}

}  // namespace

Json measureFrame(const FrameJob& job) {
  constexpr std::uint64_t seed = 7;
  if (job.kind != "grid" && job.kind != "delaunay") throw Error(fmt::format("no mesh is called {}", job.kind));
  mesh::Source source =
      job.kind == "grid" ? tests::tetrahedronGrid(job.n, 0.15, seed) : tests::delaunayCube(job.n, seed);
  const std::size_t source_bytes = bytesOf(source);
  forgetPeak();
  render::Engine engine;
  if (!job.walk) engine.walking = composite::Walking::never;
  render::Session session(std::move(source), engine);
  View view = session.defaultView(job.size, job.size);
  render::turnView(view, {20.0, 15.0, 1.0});
  session.setView(view);
  session.draw();
  const Stages s = draw(session, view, job.frames, degrees_per_frame);
  const std::size_t peak = peakBytes();
  const render::Stats stats = session.stats();
  const Stages small = draw(session, view, job.frames, degrees_of_small_move);
  const Spent look = spentOn([&] {
    session.setTransferFunction(session.transferFunction().scaled(1.01));
    session.draw();
  });
  const Spent scalar = spentOn([&] {
    session.setField(session.field().name);
    session.draw();
  });
  return {{"kind", job.kind},
          {"cells", stats.cells},
          {"size", job.size},
          {"source_bytes", source_bytes},
          {"sorter", stats.sort.algorithm},
          {"walked", stats.sort.road == "walk"},
          {"exact", stats.sort.exact},
          {"fragments", stats.composite.fragments},
          {"flagged", stats.certificate.flagged},
          {"unresolved", stats.certificate.unresolved},
          {"build_seconds", stats.build_seconds},
          {"prepare_seconds", stats.sort.prepare_seconds},
          {"frame_seconds", median(s.frame.wall)},
          {"frame_cpu_seconds", median(s.frame.cpu)},
          {"sort_seconds", median(s.sort)},
          {"project_seconds", median(s.project)},
          {"composite_seconds", median(s.composite)},
          {"small_move_sort_seconds", median(small.sort)},
          {"small_move_frame_seconds", median(small.frame.wall)},
          {"look_seconds", look.wall},
          {"scalar_seconds", scalar.wall},
          {"least_bytes", leastBytes(session.mesh(), session.field(), job.size)},
          {"kept_bytes_per_cell", stats.bytes_per_cell},
          {"peak_bytes", peak},
          {"sorts", sortRates(session.mesh(), view, job.frames)}};
}

Json measureFrameApart(const std::string& program, const FrameJob& job) {
  const std::string command =
      fmt::format("'{}' frame {} {} {} {} {}", program, job.kind, job.n, job.size, job.frames, job.walk ? 1 : 0);
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  if (!pipe) throw Error(fmt::format("cannot run {}", command));
  std::string text;
  std::array<char, 4096> buffer{};
  for (std::size_t got = 0; (got = fread(buffer.data(), 1, buffer.size(), pipe.get())) > 0;)
    text.append(buffer.data(), got);
  Json j = Json::parse(text, nullptr, false);
  if (j.is_discarded()) throw Error(fmt::format("{} gave no figures", command));
  return j;
}

}  // namespace spillikin::bench
