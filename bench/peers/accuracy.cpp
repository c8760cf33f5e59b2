#include "bench/peers/accuracy.h"

#include <fmt/format.h>

#include <array>
#include <optional>

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

std::string accuracyRows(const Subject& subject, const AccuracyOptions& options) {
  render::Engine engine;
  engine.projection = render::Projection::tets;
  render::Session session(subject.make(), engine);
  // The mappers take tetrahedra; so that all are judged by one truth, other cells are cut by the same rule for all.
  const mesh::Mesh& tetrahedra = session.drawnMesh();
  const VtkMesh grid(tetrahedra, session.drawnField());
  const reference::RayCaster caster(tetrahedra, session.drawnField());
  std::array<std::array<Errors, looks.size()>, mappers.size() + 1> errors;
  for (std::size_t l = 0; l < looks.size(); ++l) {
    const auto look = lookOf(session, looks[l].preset);
    session.setTransferFunction(look);
    const auto all = truths(caster, views(session, options.size), look);
    const auto count = static_cast<double>(all.size());
    for (std::size_t m = 0; m < mappers.size(); ++m) {
      if (errors[m][0].given_up) errors[m][l].given_up = true;
      VtkPeer peer(mappers[m], grid, look, options.size, options.size);
      if (!errors[m][l].given_up) peer.draw(all[0].view, options.limit_seconds);  // the first frame lacks cells
      for (const Truth& truth : all) {
        if (errors[m][l].given_up) break;
        errors[m][l].given_up = !peer.draw(truth.view, options.limit_seconds);
        errors[m][l].add(peer.image(), truth, count);
      }
    }
    for (const Truth& truth : all) {
      session.setView(truth.view);
      errors[mappers.size()][l].add(withoutAlpha(session.draw()), truth, count);
    }
  }
  std::string text;
  for (std::size_t m = 0; m <= mappers.size(); ++m) {
    text += fmt::format("| {} | {} |", m == 0 ? subject.label : std::string(),
                        m < mappers.size() ? name(mappers[m]) : "**Spillikin, native**");
    for (const Errors& e : errors[m])
      text += fmt::format(" {} |", e.text());
    text += "\n";
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
