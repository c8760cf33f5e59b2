#include "spillikin/mesh/field.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <numeric>

#include "spillikin/base/error.h"
#include "spillikin/mesh/parallel.h"

namespace spillikin::mesh {
namespace {

// Levenshtein's distance, letters of both cases alike.
std::size_t editDistance(const std::string& a, const std::string& b) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t above = row[j + 1];
      const std::size_t change = diagonal + (lower(a[i]) == lower(b[j]) ? 0 : 1);
      row[j + 1] = std::min({above + 1, row[j] + 1, change});
      diagonal = above;
    }
  }
  return row.back();
}

[[noreturn]] void refuseName(const Source& source, const std::string& name) {
  if (source.arrays.empty()) throw Error(fmt::format("{}: no array '{}': the file has none", source.name, name));
  std::string list;
  const Array* nearest = nullptr;
  std::size_t distance = 0;
  for (const Array& array : source.arrays) {
    list += (list.empty() ? "" : ", ") + array.name;
    const std::size_t d = editDistance(name, array.name);
    if (nearest == nullptr || d < distance) nearest = &array, distance = d;
  }
  throw Error(
      fmt::format("{}: no array '{}'; nearest is '{}'; the arrays are: {}", source.name, name, nearest->name, list));
}

// Null: the source has no array at all.
const Array* chooseArray(const Source& source, const std::string& name) {
  const auto first = [&](const auto& accept) -> const Array* {
    const auto at = std::find_if(source.arrays.begin(), source.arrays.end(), accept);
    return at == source.arrays.end() ? nullptr : &*at;
  };
  if (!name.empty()) {
    const Array* named = first([&](const Array& a) { return a.name == name; });
    if (named == nullptr) refuseName(source, name);
    return named;
  }
  for (const bool scalar : {true, false}) {
    for (const Association where : {Association::points, Association::cells}) {
      const Array* found = first([&](const Array& a) {
        return !a.identifier && a.association == where && (scalar ? a.components == 1 : a.components > 1);
      });
      if (found != nullptr) return found;
    }
  }
  return first([](const Array&) { return true; });
}

void check(const Source& source, const Array& array, int component) {
  const std::size_t tuples = array.association == Association::points ? source.points.size() : source.types.size();
  if (array.components < 1 || array.values.size() != tuples * static_cast<std::size_t>(array.components)) {
    throw Error(fmt::format("{}: array '{}' has {} values, but {} {} of {} components need {}; write the file again",
                            source.name, array.name, array.values.size(), tuples,
                            array.association == Association::points ? "points" : "cells", array.components,
                            tuples * static_cast<std::size_t>(std::max(array.components, 0))));
  }
  if (component < magnitude || component >= array.components) {
    throw Error(fmt::format("{}: array '{}' has no component {}; it has 0 to {}, or mag for the magnitude", source.name,
                            array.name, component, array.components - 1));
  }
}

double scalar(const Array& array, std::size_t tuple, int component) {
  const std::size_t n = static_cast<std::size_t>(array.components);
  const double* values = array.values.data() + tuple * n;
  if (n == 1) return values[0];
  if (component != magnitude) return values[component];
  if (n == 2) return std::hypot(values[0], values[1]);
  if (n == 3) return std::hypot(values[0], values[1], values[2]);
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i)
    sum += values[i] * values[i];
  return std::sqrt(sum);
}

// At a point that the file lacks: each component is interpolated, then taken as at any other point.
double interpolated(const Array& array, const Mesh& mesh, std::size_t made, int component) {
  Array tuple;
  tuple.components = array.components;
  const std::size_t n = static_cast<std::size_t>(array.components);
  tuple.values.assign(n, 0.0);
  const Id begin = mesh.made_offset[made], end = mesh.made_offset[made + 1];
  for (std::size_t c = 0; c < n; ++c) {
    // Relative to the first, so that a constant stays exactly constant.
    const double first = array.values[mesh.made_point[begin] * n + c];
    for (Id i = begin; i < end; ++i) {
      tuple.values[c] += mesh.made_weight[i] * (array.values[mesh.made_point[i] * n + c] - first);
    }
    tuple.values[c] += first;
  }
  return scalar(tuple, 0, component);
}

// Calls value(i, values[i]) for all i < n; false from it means that the mesh was not built from this source.
template <class Value>
void fill(const Source& source, const Array& array, std::size_t n, std::vector<double>& values, const Value& value) {
  std::atomic<bool> strange{false};
  values.resize(n);
  parallelFor(n, [&](std::size_t i) {
    if (!value(i, values[i])) strange.store(true, std::memory_order_relaxed);
  });
  if (strange) {
    throw Error(fmt::format("{}: array '{}' does not reach all of the mesh; build the mesh from this file", source.name,
                            array.name));
  }
}

void pointValues(const Source& source, const Mesh& mesh, const Array& array, int component,
                 std::vector<double>& values) {
  const std::size_t in_file = source.points.size();
  const std::size_t made = mesh.made_offset.empty() ? 0 : mesh.made_offset.size() - 1;
  fill(source, array, mesh.points.size(), values, [&](std::size_t v, double& value) {
    const std::size_t p = mesh.point_file_id[v];
    if (p >= in_file + made) return false;
    value = p < in_file ? scalar(array, p, component) : interpolated(array, mesh, p - in_file, component);
    return true;
  });
}

void cellValues(const Source& source, const Mesh& mesh, const Array& array, int component,
                std::vector<double>& values) {
  fill(source, array, mesh.cell_count(), values, [&](std::size_t c, double& value) {
    const std::size_t file = mesh.cell_file_id[c];
    if (file >= source.types.size()) return false;
    value = scalar(array, file, component);
    return true;
  });
}

struct Range {
  double lo = INFINITY, hi = -INFINITY;
  std::size_t hidden = 0;
};

// Marks the cells with a value that is not finite, and finds the range of the others.
void lookAtValues(const Mesh& mesh, Field& field) {
  std::vector<std::uint8_t> hidden(mesh.cell_count(), 0);
  const auto visit = [&](std::size_t cell, Range& range) {
    double lo = INFINITY, hi = -INFINITY;
    bool finite = true;
    const auto look = [&](double value) {
      finite = finite && std::isfinite(value);
      lo = std::min(lo, value);
      hi = std::max(hi, value);
    };
    if (field.association == Association::cells) {
      look(field.values[cell]);
    } else {
      for (const Id v : mesh.vertices(static_cast<Id>(cell)))
        look(field.values[v]);
    }
    if (finite) {
      range.lo = std::min(range.lo, lo);
      range.hi = std::max(range.hi, hi);
    } else {
      hidden[cell] = 1;
      ++range.hidden;
    }
  };
  const Range range = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.cell_count(), block_size), Range{},
      [&](const tbb::blocked_range<std::size_t>& cells, Range r) {
        for (std::size_t c = cells.begin(); c != cells.end(); ++c)
          visit(c, r);
        return r;
      },
      [](const Range& a, const Range& b) {
        return Range{std::min(a.lo, b.lo), std::max(a.hi, b.hi), a.hidden + b.hidden};
      });
  field.hidden_count = range.hidden;
  if (range.hidden > 0) field.hidden = std::move(hidden);
  field.lo = range.lo <= range.hi ? range.lo : 0.0;
  field.hi = range.lo <= range.hi ? range.hi : 0.0;
}

}  // namespace

Field selectField(const Source& source, const Mesh& mesh, const std::string& name, int component) {
  Field field;
  const Array* array = chooseArray(source, name);
  if (array == nullptr) {
    field.values.assign(mesh.points.size(), 0.0);
    return field;
  }
  check(source, *array, component);
  field.name = array->name;
  if (array->components > 1) {
    field.name += component == magnitude ? " (magnitude)" : fmt::format(" ({})", component);
  }
  field.association = array->association;
  if (array->association == Association::cells) {
    cellValues(source, mesh, *array, component, field.values);
  } else {
    pointValues(source, mesh, *array, component, field.values);
  }
  lookAtValues(mesh, field);
  return field;
}

}  // namespace spillikin::mesh
