#include "spillikin/sort/convex_polygons.h"

namespace spillikin::sort {

ConvexPolygon ConvexPolygons::add(std::span<const Vec3> corners) {
  const auto begin = static_cast<std::uint32_t>(corners_.size());
  corners_.insert(corners_.end(), corners.begin(), corners.end());
  return {begin, static_cast<std::uint32_t>(corners.size())};
}

ConvexPolygon ConvexPolygons::clip(ConvexPolygon polygon, const HalfSpace& half) {
  const int on = side(polygon, half);
  if (on == 1) return polygon;
  if (on != 0) return {};
  const auto begin = static_cast<std::uint32_t>(corners_.size());
  Vec3 p = corners_[polygon.begin + polygon.count - 1];
  double hp = height(half, p);
  for (std::uint32_t k = 0; k < polygon.count; ++k) {
    const Vec3 q = corners_[polygon.begin + k];
    const double hq = height(half, q);
    if ((hp > tolerance_ && hq < -tolerance_) || (hp < -tolerance_ && hq > tolerance_)) {
      corners_.push_back(p + (q - p) * (hp / (hp - hq)));
    }
    if (hq >= -tolerance_) corners_.push_back(q);
    p = q;
    hp = hq;
  }
  const auto count = static_cast<std::uint32_t>(corners_.size()) - begin;
  if (count >= 3) return {begin, count};
  corners_.resize(begin);
  return {};
}

int ConvexPolygons::side(ConvexPolygon polygon, const HalfSpace& half) const {
  bool above = false, below = false;
  for (const Vec3& p : (*this)[polygon]) {
    const double h = height(half, p);
    above = above || h > tolerance_;
    below = below || h < -tolerance_;
  }
  return above && below ? 0 : above ? 1 : below ? -1 : 2;
}

}  // namespace spillikin::sort
