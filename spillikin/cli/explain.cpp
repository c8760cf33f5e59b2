#include "spillikin/cli/explain.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "spillikin/base/error.h"
#include "spillikin/integrate/optics.h"
#include "spillikin/integrate/segment.h"
#include "spillikin/reference/reference.h"

namespace spillikin::cli {

namespace {

// Place of each drawn cell in the order, counted from the back; the last one where a cell was cut.
std::vector<std::size_t> placesInOrder(const sort::Order& order, std::size_t cells) {
  std::vector<std::size_t> place(cells, 0);
  for (std::size_t i = 0; i < order.cells.size(); ++i)
    place[order.cells[i]] = i;
  return place;
}

std::string colourText(const float* rgba) {
  return fmt::format("({:.6f}, {:.6f}, {:.6f}, {:.6f})", rgba[0], rgba[1], rgba[2], rgba[3]);
}

}  // namespace

std::string explainPixel(render::Session& session, int x, int y, bool positions, const Image* image,
                         mesh::FieldModel model) {
  const View& view = session.view();
  if (x < 0 || y < 0 || x >= view.width || y >= view.height) {
    throw Error(fmt::format("--pixel {},{} is outside of the image of {}x{}; pixels count from 0 at the top left", x, y,
                            view.width, view.height));
  }
  const mesh::Mesh& mesh = session.drawnMesh();
  const mesh::Field& field = session.drawnField();
  const reference::RayCaster caster(mesh, field);
  std::vector<reference::Interval> intervals;
  reference::Options options;
  options.model = model;
  caster.intervals(view, x + 0.5, y + 0.5, options, intervals);

  std::vector<std::size_t> place;
  if (positions) place = placesInOrder(session.order(), mesh.cell_count());
  std::string text = fmt::format("pixel {},{}: {} interval{}, front to back\n", x, y, intervals.size(),
                                 intervals.size() == 1 ? "" : "s");
  text += fmt::format("{:>10} {:<12} {:>14} {:>14} {:>13} {:>13} {:>9} {:>27}{}\n", "cell", "type", "enter", "leave",
                      "scalar front", "scalar back", "opacity", "contribution r, g, b", positions ? "     place" : "");
  const integrate::Optics optics = session.optics();
  integrate::Gathered gathered;
  integrate::Radiance sum;
  for (const auto& i : intervals) {
    const integrate::TransferFunction& tf = session.transferFunction();
    const double alpha = integrate::integrate(tf, i.front, i.back, i.leave - i.enter).alpha;
    const integrate::Radiance before = sum;
    gather(optics, tf, i.front, i.back, i.leave - i.enter, gathered);
    sum = radiance(optics, tf, gathered);
    const auto gained = [&](std::size_t k) { return sum.color[k] - before.color[k]; };
    text +=
        fmt::format("{:>10} {:<12} {:>14.8g} {:>14.8g} {:>13.6g} {:>13.6g} {:>9.6f} {:>8.6f} {:>8.6f} {:>8.6f} {}\n",
                    mesh.cell_file_id[i.cell], mesh::name(mesh.cell_type[i.cell]), i.enter, i.leave, i.front, i.back,
                    alpha, gained(0), gained(1), gained(2), positions ? fmt::format("{:>9}", place[i.cell]) : "");
  }
  text += fmt::format("sum     ({:.6f}, {:.6f}, {:.6f}, {:.6f}), premultiplied\n", sum.color[0], sum.color[1],
                      sum.color[2], sum.alpha);
  if (image != nullptr) text += "picture " + colourText(image->pixel(x, y)) + "\n";
  return text;
}

}  // namespace spillikin::cli
