#include "bench/peers/accuracy.h"

#include <fmt/format.h>

#include <array>
#include <functional>

#include "bench/peers/child.h"
#include "bench/peers/vtk_peer.h"
#include "bench/suite.h"
#include "spillikin/base/error.h"
#include "spillikin/reference/compare.h"
#include "spillikin/reference/reference.h"

namespace spillikin::bench {

namespace {

constexpr std::array mappers{Mapper::projected_tetrahedra, Mapper::bunyk_preintegrated, Mapper::bunyk_linear,
                             Mapper::zsweep};

// Nonzero for the pixels left out: those that the mesh does not cover together with their eight neighbours. The ray
// casters spill over the silhouette; that is half a pixel's shift and would drown everything else.
std::vector<std::uint8_t> outsideInterior(const Image& truth, std::vector<std::uint8_t> apart) {
  const auto covered = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < truth.width && y < truth.height && truth.pixel(x, y)[3] > 0.0F;
  };
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      for (int k = 0; k < 9; ++k) {
        if (covered(x + k % 3 - 1, y + k / 3 - 1)) continue;
        apart[static_cast<std::size_t>(y) * static_cast<std::size_t>(truth.width) + static_cast<std::size_t>(x)] = 1;
      }
    }
  }
  return apart;
}

Image withoutAlpha(Image image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    image.rgba[i] = 0.0F;
  return image;
}

struct Truth {
  View view;
  Image image;
  std::vector<std::uint8_t> apart;
};

struct Errors {
  double max = 0.0, mean = 0.0;
  bool given_up = false;

  void add(const Image& image, const Truth& truth, double views) {
    reference::CompareOptions options;
    options.apart = truth.apart;
    const auto c = reference::compare(image, truth.image, options);
    max = std::max(max, c.worst.max);
    mean += c.worst.mean / views;
  }
  std::string text() const { return given_up ? std::string("given up") : fmt::format("{:.4f} / {:.4f}", max, mean); }
};

std::vector<Truth> truths(const reference::RayCaster& caster, const std::vector<View>& from,
                          const integrate::TransferFunction& look) {
  std::vector<Truth> all;
  for (const View& view : from) {
    const Image truth = caster.render(view, look, {});
    all.push_back({view, withoutAlpha(truth), outsideInterior(truth, caster.edgeOnMask(view))});
  }
  return all;
}

}  // namespace

std::vector<Subject> judgedSubjects(const std::string& folder) {
  std::vector<Subject> all = subjects({});
  for (const auto& path : meshes(folder))
    all.push_back({path.filename().string(), {}, [path] { return read(path); }, 0});
  return all;
}

namespace {

// Everything that is judged on one subject: the mappers take tetrahedra, so that all are held to one truth, other cells
// are cut by the same rule for all.
struct Trial {
  explicit Trial(const Subject& subject)
      : session(subject.make(), {.projection = render::Projection::tets}),
        grid(session.drawnMesh(), session.drawnField()),
        caster(session.drawnMesh(), session.drawnField()) {}
  render::Session session;
  VtkMesh grid;
  reference::RayCaster caster;
};

using RowErrors = std::array<Errors, looks.size()>;

void judgeMapper(Trial& trial, Mapper mapper, std::size_t l, const std::vector<Truth>& all,
                 const AccuracyOptions& options, RowErrors& errors) {
  if (errors[0].given_up) errors[l].given_up = true;
  if (errors[l].given_up) return;
  VtkPeer peer(mapper, trial.grid, lookOf(trial.session, looks[l].preset), options.size, options.size);
  peer.draw(all[0].view, options.limit_seconds);  // the first frame lacks cells
  for (const Truth& truth : all) {
    errors[l].given_up = !peer.draw(truth.view, options.limit_seconds);
    if (errors[l].given_up) return;
    errors[l].add(peer.image(), truth, static_cast<double>(all.size()));
  }
}

void judgeOurs(Trial& trial, std::size_t l, const std::vector<Truth>& all, RowErrors& errors) {
  trial.session.setTransferFunction(lookOf(trial.session, looks[l].preset));
  for (const Truth& truth : all) {
    trial.session.setView(truth.view);
    errors[l].add(withoutAlpha(trial.session.draw()), truth, static_cast<double>(all.size()));
  }
}

// The rows from contender `first` on; the last is Spillikin.
void judge(const Subject& subject, const AccuracyOptions& options, std::size_t first,
           const std::function<void(const std::string&)>& emit) {
  Trial trial(subject);
  std::array<std::vector<Truth>, looks.size()> all;
  for (std::size_t l = 0; l < looks.size(); ++l)
    all[l] = truths(trial.caster, views(trial.session, options.size), lookOf(trial.session, looks[l].preset));
  for (std::size_t m = first; m <= mappers.size(); ++m) {
    RowErrors errors;
    for (std::size_t l = 0; l < looks.size(); ++l) {
      if (m < mappers.size()) {
        judgeMapper(trial, mappers[m], l, all[l], options, errors);
      } else {
        judgeOurs(trial, l, all[l], errors);
      }
    }
    std::string row;
    for (const Errors& e : errors)
      row += fmt::format(" {} |", e.text());
    emit(row);
  }
}

}  // namespace

std::string accuracyRows(const Subject& subject, const AccuracyOptions& options) {
  std::vector<std::string> rows;
  while (rows.size() <= mappers.size()) {
    const std::size_t first = rows.size();
    const Rows made = rowsOfChild([&](const auto& emit) { judge(subject, options, first, emit); });
    rows.insert(rows.end(), made.rows.begin(), made.rows.end());
    if (rows.size() <= mappers.size()) rows.emplace_back(" crashed | crashed | crashed |");
  }
  std::string text;
  for (std::size_t m = 0; m <= mappers.size(); ++m) {
    text += fmt::format("| {} | {} |{}\n", m == 0 ? subject.label : std::string(),
                        m < mappers.size() ? name(mappers[m]) : "**Spillikin, native**", rows[m]);
  }
  return text;
}

std::string accuracyHeading(const AccuracyOptions& options) {
  return fmt::format(
      "\n## VTK {0}'s mappers against the same reference\n\n{1}×{1} pixels, the same three views and transfer "
      "functions; colours on black, the largest of three channels, max over the views / mean. Only pixels whose eight "
      "neighbours are covered too, without those on edge-on exterior faces: the ray casters sample half a pixel off "
      "and "
      "spill over the silhouette. The mappers' pictures have 8 bits, so 0.002 is as good as it gets for them. Other "
      "cells "
      "are cut into tetrahedra by the same rule for all.\n\n| mesh | way | smooth (viridis) | jumping (steps) | comb "
      "|\n|---|---|---|---|---|\n",
      vtkVersion(), options.size);
}

}  // namespace spillikin::bench
