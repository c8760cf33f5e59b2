#include "spillikin/mesh/points.h"

#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "spillikin/mesh/parallel.h"

namespace spillikin::mesh {

PointPool::PointPool(const Source& source) : source_(&source) {
  for (const Array& array : source.arrays) {
    const std::size_t wanted = source.points.size() * static_cast<std::size_t>(std::max(array.components, 0));
    if (array.association == Association::points && array.values.size() == wanted) arrays_.push_back(&array);
  }
}

Id PointPool::make(std::span<const Share> shares) {
  Vec3 place(0.0);
  for (const Share& share : shares)
    place += share.weight * source_->points[share.point];
  made_.push_back(place);
  shares_.insert(shares_.end(), shares.begin(), shares.end());
  share_offset_.push_back(shares_.size());
  return static_cast<Id>(size() - 1);
}

std::span<const Share> PointPool::shares(std::size_t i) const {
  const std::size_t k = i - fromFile();
  return {shares_.data() + share_offset_[k], shares_.data() + share_offset_[k + 1]};
}

int PointPool::compareValues(std::size_t i, std::size_t j) const {
  for (const Array* array : arrays_) {
    const std::size_t n = static_cast<std::size_t>(array->components);
    const auto value = [&](std::size_t point, std::size_t component) {
      if (point < fromFile()) return array->values[point * n + component];
      double sum = 0.0;
      for (const Share& share : shares(point))
        sum += share.weight * array->values[share.point * n + component];
      return sum;
    };
    for (std::size_t component = 0; component < n; ++component) {
      const auto a = std::bit_cast<std::uint64_t>(value(i, component));
      const auto b = std::bit_cast<std::uint64_t>(value(j, component));
      if (a != b) return a < b ? -1 : 1;
    }
  }
  return 0;
}

namespace {

struct Box {
  Vec3 lower{std::numeric_limits<double>::infinity()}, upper{-std::numeric_limits<double>::infinity()};
  void add(const Vec3& p) { lower = glm::min(lower, p), upper = glm::max(upper, p); }
  void add(const Box& other) { lower = glm::min(lower, other.lower), upper = glm::max(upper, other.upper); }
};

Box boundingBox(const PointPool& pool, const std::vector<std::uint32_t>& ids) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, ids.size(), block_size), Box{},
      [&](const tbb::blocked_range<std::size_t>& range, Box box) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          box.add(pool[ids[i]]);
        return box;
      },
      [](Box a, const Box& b) {
        a.add(b);
        return a;
      });
}

// Every third bit of the result is one of x's 21.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffffULL;
  x = (x | x << 16) & 0x001f0000ff0000ffULL;
  x = (x | x << 8) & 0x100f00f00f00f00fULL;
  x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
  return (x | x << 2) & 0x1249249249249249ULL;
}

std::uint64_t morton(const Vec3& p, const Box& box, double scale) {
  constexpr double largest = 2097151.0;  // 2^21 - 1
  // A box so large that the extent overflows gives everything one key: slower, not wrong.
  const auto digit = [&](double x, double lower) {
    const double t = (x - lower) * scale;
    return spread(t > 0.0 ? static_cast<std::uint64_t>(std::min(t, largest)) : 0U);
  };
  return digit(p.x, box.lower.x) | digit(p.y, box.lower.y) << 1 | digit(p.z, box.lower.z) << 2;
}

// Sorts points of one key so that equal coordinates follow each other, and files them in order.
class Grouper {
 public:
  Grouper(const PointPool& pool, Numbering& out) : pool_(pool), out_(out) {}

  void addRun(std::span<Id> run) {
    if (run.size() > 1) {
      std::sort(run.begin(), run.end(), [&](Id a, Id b) {
        const Vec3 &p = pool_[a], &q = pool_[b];
        if (p.x != q.x) return p.x < q.x;
        if (p.y != q.y) return p.y < q.y;
        if (p.z != q.z) return p.z < q.z;
        return a < b;
      });
    }
    for (std::size_t begin = 0, end = 0; begin < run.size(); begin = end) {
      for (end = begin + 1; end < run.size() && pool_[run[end]] == pool_[run[begin]];)
        ++end;
      end - begin == 1 ? addVertex(run[begin]) : addGroup(run.subspan(begin, end - begin));
    }
  }

 private:
  void addVertex(Id point) {
    out_.vertex[point] = static_cast<Id>(out_.point.size());
    out_.point.push_back(point);
  }

  // Points at one place: those with equal values become one, the others keep the order of the file.
  void addGroup(std::span<Id> group) {
    std::sort(group.begin(), group.end(), [&](Id a, Id b) {
      const int order = pool_.compareValues(a, b);
      return order != 0 ? order < 0 : a < b;
    });
    std::vector<Id> first;  // of each class; and in vertex, for the moment, its first
    for (std::size_t i = 0; i < group.size(); ++i) {
      const bool opens = i == 0 || pool_.compareValues(group[i - 1], group[i]) != 0;
      if (opens) first.push_back(group[i]);
      out_.vertex[group[i]] = first.back();
    }
    std::sort(first.begin(), first.end());
    std::vector<Id> number(first.size());
    for (std::size_t k = 0; k < first.size(); ++k) {
      number[k] = static_cast<Id>(out_.point.size());
      out_.point.push_back(first[k]);
    }
    for (const Id point : group) {
      const auto at = std::lower_bound(first.begin(), first.end(), out_.vertex[point]) - first.begin();
      out_.vertex[point] = number[static_cast<std::size_t>(at)];
    }
    out_.merged += group.size() - first.size();
    if (first.size() > 1) out_.coincident += first.size();
  }

  const PointPool& pool_;
  Numbering& out_;
};

}  // namespace

Numbering numberPoints(const PointPool& pool, const std::vector<std::uint8_t>& used) {
  std::vector<std::uint32_t> ids;
  ids.reserve(pool.size());
  for (std::size_t i = 0; i < pool.size(); ++i) {
    if (used[i] != 0) ids.push_back(static_cast<std::uint32_t>(i));
  }
  const Box box = boundingBox(pool, ids);
  const Vec3 extent = box.upper - box.lower;
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double scale = longest > 0.0 && std::isfinite(2097152.0 / longest) ? 2097152.0 / longest : 0.0;
  std::vector<std::uint64_t> keys(ids.size());
  parallelFor(ids.size(), [&](std::size_t i) { keys[i] = morton(pool[ids[i]], box, scale); });
  radixSort(keys, ids);

  Numbering numbering;
  numbering.vertex.assign(pool.size(), none);
  numbering.point.reserve(ids.size());
  Grouper grouper(pool, numbering);
  for (std::size_t begin = 0, end = 0; begin < ids.size(); begin = end) {
    for (end = begin + 1; end < ids.size() && keys[end] == keys[begin];)
      ++end;
    grouper.addRun(std::span<Id>(ids).subspan(begin, end - begin));
  }
  if (numbering.coincident > 0) {
    numbering.place.resize(numbering.point.size());
    for (std::size_t v = 0; v < numbering.point.size(); ++v) {
      const bool again = v > 0 && pool[numbering.point[v]] == pool[numbering.point[v - 1]];
      numbering.place[v] = again ? numbering.place[v - 1] : static_cast<Id>(v);
    }
  }
  return numbering;
}

}  // namespace spillikin::mesh
