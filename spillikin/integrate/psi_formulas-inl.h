// The formulas of psi_float.h over any Ops. No include guard and no namespace: it is included inside the namespace of
// psi_float.h, and once for each instruction set inside that of segment_simd-inl.h, because functions compiled for one
// instruction set cannot be inlined into those of another.

template <class Ops, std::size_t N>
inline typename Ops::V horner(const Ops& o, const std::array<float, N>& c, typename Ops::V t) {
  auto sum = o.set(c[N - 1]);
  for (std::size_t k = N - 1; k-- > 0;)
    sum = o.mulAdd(sum, t, o.set(c[k]));
  return sum;
}

// exp(-m) for m >= 0. Beyond 64 it stays at 2e-28, which no float beside it can tell from 0: products of smaller
// numbers would be denormal, and slow.
template <class Ops>
inline typename Ops::V expOfMinus(const Ops& o, typename Ops::V m) {
  const auto exponent = o.mul(o.min(m, o.set(64.0F)), o.set(-1.44269504F));
  const auto whole = o.round(exponent);
  return o.mul(horner(o, power2, o.sub(exponent, whole)), o.exp2i(whole));
}

// For x + y < 2 thin.
template <class Ops>
inline Weights<typename Ops::V> thinWeights(const Ops& o, typename Ops::V x, typename Ops::V y) {
  const auto half = o.set(0.5F);
  const auto m = o.mul(half, o.add(x, y));
  const auto e = o.mul(half, o.sub(y, x));
  const auto m2 = o.mul(m, m);
  auto share = o.mulAdd(m2, o.set(thin_m6), horner(o, thin_m4, e));
  share = o.mulAdd(m2, share, horner(o, thin_m2, e));
  share = o.mulAdd(m2, share, o.mul(e, horner(o, thin_m0, e)));  // m delta
  const auto per_depth = horner(o, opacity, m);
  const auto middle = o.mul(half, m);
  return {o.mul(per_depth, o.add(middle, share)), o.mul(per_depth, o.sub(middle, share)), o.mul(per_depth, m)};
}

// For x + y >= 2 thin.
template <class Ops>
inline Weights<typename Ops::V> thickWeights(const Ops& o, typename Ops::V x, typename Ops::V y) {
  using V = typename Ops::V;
  x = o.min(x, o.set(most));
  y = o.min(y, o.set(most));
  const auto zero = o.set(0.0F);
  const auto d = o.sub(y, x);
  const auto two_d = o.mul(o.set(2.0F), o.abs(d));
  const auto root = o.sqrt(two_d);  // 2 a, a = sqrt(|d| / 2)
  // Both ends of Psi = end(x) - zeta end(y): sqrt(pi)/2 erfcx(x / 2a) / a or F(x / 2a) / a.
  const auto growingEnd = [&](V end) {
    const auto inverse = o.reciprocal(o.mulAdd(o.set(growing_scale), end, root));
    return o.mul(horner(o, growing, o.mul(root, inverse)), inverse);
  };
  const auto fallingEnd = [&](V end) {
    const auto inverse = o.reciprocal(o.mulAdd(o.mul(o.set(falling_scale), end), end, two_d));
    const auto t = o.mul(two_d, inverse);
    return o.mul(o.mul(o.mul(end, inverse), horner(o, falling_over, t)), o.reciprocal(horner(o, falling_under, t)));
  };
  const auto zeta = expOfMinus(o, o.mul(o.set(0.5F), o.add(x, y)));
  const auto falls = o.less(d, zero);
  auto at_front = growingEnd(x);
  auto at_back = growingEnd(y);
  if (!o.all(o.less(zero, d))) {
    at_front = o.select(falls, fallingEnd(x), at_front);
    at_back = o.select(falls, fallingEnd(y), at_back);
  }
  const auto psi = o.sub(at_front, o.mul(zeta, at_back));
  const auto one = o.set(1.0F);
  return {o.sub(one, psi), o.sub(psi, zeta), o.sub(one, zeta)};
}

template <class Ops>
inline Weights<typename Ops::V> weights(const Ops& o, typename Ops::V x, typename Ops::V y) {
  const auto is_thin = o.less(o.add(x, y), o.set(2.0F * thin));
  const auto a = thinWeights(o, x, y);
  if (o.all(is_thin)) return a;
  const auto b = thickWeights(o, x, y);
  return {o.select(is_thin, a.front, b.front), o.select(is_thin, a.back, b.back), o.select(is_thin, a.alpha, b.alpha)};
}
