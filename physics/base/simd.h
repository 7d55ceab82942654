/// \file Packs of doubles: kernels are templates on a Real that is a pack of one or more lanes.
/// The only file with intrinsics. (<experimental/simd> of GCC 12 leaves its broadcasts as calls in
/// large kernels, which made them several times slower.)
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "physics/base/types.h"

#if defined(__AVX512F__) || defined(__FMA__)
#include <immintrin.h>
#endif

namespace lahar {

#define LAHAR_INLINE [[gnu::always_inline]] inline
/// Before a loop of few steps, all known to the compiler, over arrays of packs: they then live in
/// registers. (GCC 12 decides otherwise too often.)
#define LAHAR_UNROLL _Pragma("GCC unroll 64")

template <int W>
struct VectorOf {
  typedef double type __attribute__((vector_size(8 * W)));  // NOLINT: attribute needs typedef
};
template <>
struct VectorOf<1> {
  using type = double;
};

template <int W>
struct ProductOf;

/// W doubles that are computed with together. Operations are lane by lane; a plain double stands
/// for a pack that holds it in every lane.
template <int W>
struct PackOf {
  using Value = typename VectorOf<W>::type;
  Value v;

  PackOf() = default;
  LAHAR_INLINE PackOf(double s) {
    if constexpr (W == 1)
      v = s;
    else
      v = s - Value{};
  }
  LAHAR_INLINE static PackOf of(Value value) {
    PackOf pack;
    pack.v = value;
    return pack;
  }
  LAHAR_INLINE double operator[](int lane) const {
    if constexpr (W == 1)
      return v;
    else
      return v[lane];
  }

  LAHAR_INLINE friend PackOf operator+(PackOf a, PackOf b) { return of(a.v + b.v); }
  LAHAR_INLINE friend PackOf operator-(PackOf a, PackOf b) { return of(a.v - b.v); }
  LAHAR_INLINE friend ProductOf<W> operator*(PackOf a, PackOf b) { return {a, b}; }
  LAHAR_INLINE friend PackOf operator/(PackOf a, PackOf b) { return of(a.v / b.v); }
  LAHAR_INLINE friend PackOf operator-(PackOf a) { return of(-a.v); }
  LAHAR_INLINE PackOf& operator+=(PackOf b) { return *this = *this + b; }
  LAHAR_INLINE PackOf& operator-=(PackOf b) { return *this = *this - b; }
  LAHAR_INLINE PackOf& operator+=(const ProductOf<W>& p) { return *this = *this + p; }
  LAHAR_INLINE PackOf& operator-=(const ProductOf<W>& p) { return *this = *this - p; }
  LAHAR_INLINE PackOf& operator*=(PackOf b) { return *this = of(v * b.v); }
};

#if defined(__AVX512F__)
inline constexpr int native_lanes = 8;
#elif defined(__AVX__)
inline constexpr int native_lanes = 4;
#else
inline constexpr int native_lanes = 2;
#endif

/// a b + c, rounded once where the machine can.
template <int W>
LAHAR_INLINE PackOf<W> fma(PackOf<W> a, PackOf<W> b, PackOf<W> c) {
#if defined(__FMA__)
  using Value = typename PackOf<W>::Value;
  if constexpr (W == 1) return PackOf<W>::of(__builtin_fma(a.v, b.v, c.v));
  if constexpr (W == 2) return PackOf<W>::of(Value(_mm_fmadd_pd(a.v, b.v, c.v)));
  if constexpr (W == 4) return PackOf<W>::of(Value(_mm256_fmadd_pd(a.v, b.v, c.v)));
#if defined(__AVX512F__)
  if constexpr (W == 8) return PackOf<W>::of(Value(_mm512_fmadd_pd(a.v, b.v, c.v)));
#else
  if constexpr (W == 8) {
    const auto low = [](const Value& v) {
      return PackOf<4>::of(__builtin_shufflevector(v, v, 0, 1, 2, 3));
    };
    const auto high = [](const Value& v) {
      return PackOf<4>::of(__builtin_shufflevector(v, v, 4, 5, 6, 7));
    };
    return PackOf<W>::of(__builtin_shufflevector(fma(low(a.v), low(b.v), low(c.v)).v,
                                                 fma(high(a.v), high(b.v), high(c.v)).v, 0, 1, 2, 3,
                                                 4, 5, 6, 7));
  }
#endif
#else
  return PackOf<W>::of(a.v * b.v + c.v);
#endif
}

/// a b, rounded when it becomes a pack. A sum or difference that takes it in the same expression
/// rounds once: a b + c is fma(a, b, c), and a b + c d is fma(a, b, c d). Which products a sum
/// takes is thus in the source. (Compilers are told not to contract: what they choose depends on
/// inlining, on the width of packs and on the level of optimisation.)
template <int W>
struct ProductOf {
  using Real = PackOf<W>;
  Real a, b;

  LAHAR_INLINE operator Real() const { return Real::of(a.v * b.v); }
  LAHAR_INLINE friend ProductOf operator-(const ProductOf& p) { return {-p.a, p.b}; }

  LAHAR_INLINE friend Real operator+(Real c, const ProductOf& p) { return fma(p.a, p.b, c); }
  LAHAR_INLINE friend Real operator+(const ProductOf& p, Real c) { return fma(p.a, p.b, c); }
  LAHAR_INLINE friend Real operator+(const ProductOf& p, const ProductOf& q) { return p + Real(q); }
  LAHAR_INLINE friend Real operator-(Real c, const ProductOf& p) { return fma(-p.a, p.b, c); }
  LAHAR_INLINE friend Real operator-(const ProductOf& p, Real c) { return fma(p.a, p.b, -c); }
  LAHAR_INLINE friend Real operator-(const ProductOf& p, const ProductOf& q) { return p - Real(q); }

  LAHAR_INLINE friend ProductOf operator*(Real c, const ProductOf& p) { return {c, Real(p)}; }
  LAHAR_INLINE friend ProductOf operator*(const ProductOf& p, Real c) { return {Real(p), c}; }
  LAHAR_INLINE friend ProductOf operator*(const ProductOf& p, const ProductOf& q) {
    return {Real(p), Real(q)};
  }
  LAHAR_INLINE friend Real operator/(Real c, const ProductOf& p) { return c / Real(p); }
  LAHAR_INLINE friend Real operator/(const ProductOf& p, Real c) { return Real(p) / c; }
  LAHAR_INLINE friend Real operator/(const ProductOf& p, const ProductOf& q) {
    return Real(p) / Real(q);
  }
};

/// The pack that packs, products and doubles are computed with together in.
template <class A, class B>
using PackIn = decltype(std::declval<A>() + std::declval<B>());

template <class A, class B, class C>
LAHAR_INLINE PackIn<A, PackIn<B, C>> fma(const A& a, const B& b, const C& c) {
  using Real = PackIn<A, PackIn<B, C>>;
  return fma(Real(a), Real(b), Real(c));
}

using Pack = PackOf<native_lanes>;  ///< production: the widest vector
using Scalar = PackOf<1>;           ///< tests, and loads that act on few particles

/// What kernels are compiled for. Tests compile them again, for single particles.
#ifdef LAHAR_SINGLE_PARTICLES
using KernelReal = Scalar;
#else
using KernelReal = Pack;
#endif

template <class Real>
inline constexpr int lanes = static_cast<int>(sizeof(Real) / sizeof(double));

template <class Real>
LAHAR_INLINE Real load(const double* p) {
  Real pack;
  __builtin_memcpy(&pack.v, p, sizeof(pack.v));
  return pack;
}

/// One double from memory in every lane, as one load. (Left to itself, GCC 12 loads neighbouring
/// doubles together and shuffles them apart, or gathers them, which processors with the mitigation
/// of Gather Data Sampling do at a twentieth of the speed.)
template <class Real>
LAHAR_INLINE Real broadcast(const double* p) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    typename Real::Value v;
    asm("vbroadcastsd %1, %0" : "=v"(v) : "m"(*p));
    return Real::of(v);
  }
#endif
#if defined(__AVX__)
  if constexpr (lanes<Real> == 4) {
    typename Real::Value v;
    asm("vbroadcastsd %1, %0" : "=x"(v) : "m"(*p));
    return Real::of(v);
  }
#endif
  return Real(*p);
}

/// Four doubles from memory, in the lower and in the upper lanes.
LAHAR_INLINE PackOf<8> broadcast_four(const double* p) {
#if defined(__AVX512F__)
  return PackOf<8>::of(PackOf<8>::Value(_mm512_maskz_broadcast_f64x4(0xff, _mm256_loadu_pd(p))));
#else
  const auto v = load<PackOf<4>>(p).v;
  return PackOf<8>::of(__builtin_shufflevector(v, v, 0, 1, 2, 3, 0, 1, 2, 3));
#endif
}

/// a * b with b one double in memory for all lanes: one instruction.
template <class Real>
LAHAR_INLINE Real multiply(const Real& a, const double* b) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    typename Real::Value v;
    asm("vmulpd %2%{1to8%}, %1, %0" : "=v"(v) : "v"(a.v), "m"(*b));
    return Real::of(v);
  }
#endif
  return Real::of(a.v * broadcast<Real>(b).v);
}

/// sum + a * b with b one double in memory for all lanes: one instruction, rounded once.
template <class Real>
LAHAR_INLINE Real multiply_add(const Real& sum, const Real& a, const double* b) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    auto v = sum.v;
    asm("vfmadd231pd %2%{1to8%}, %1, %0" : "+v"(v) : "v"(a.v), "m"(*b));
    return Real::of(v);
  }
#endif
  return sum + a * broadcast<Real>(b);
}

/// How far ahead of the particles at work those to come are fetched to the second-level cache: the
/// pieces in which a phase goes through a patch are too short for the hardware to foresee.
inline constexpr Local prefetch_distance = 128;

template <std::size_t N>
LAHAR_INLINE void prefetch(const std::array<double*, N>& rows, Local p) {
  LAHAR_UNROLL
  for (std::size_t k = 0; k < N; ++k) __builtin_prefetch(rows[k] + p + prefetch_distance, 1, 2);
}

template <class Real>
LAHAR_INLINE void store(const Real& value, double* p) {
  __builtin_memcpy(p, &value.v, sizeof(value.v));
}

/// The first n lanes (all if n is larger) of a value, zero in the others.
template <class Real>
LAHAR_INLINE Real first_lanes(const Real& value, Local n) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    const auto mask = static_cast<__mmask8>(n >= 8 ? 0xff : (1u << n) - 1);
    return Real::of(reinterpret_cast<typename Real::Value>(
        _mm512_maskz_mov_pd(mask, reinterpret_cast<__m512d>(value.v))));
  }
#endif
  if (n >= lanes<Real>) return value;
  double values[lanes<Real>] = {};
  for (int lane = 0; lane < n; ++lane) values[lane] = value[lane];
  return load<Real>(values);
}

/// The first n lanes (all if n is larger) from memory, zero in the others.
template <class Real>
LAHAR_INLINE Real load_first(const double* p, Local n) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    const auto mask = static_cast<__mmask8>(n >= 8 ? 0xff : (1u << n) - 1);
    return Real::of(reinterpret_cast<typename Real::Value>(_mm512_maskz_loadu_pd(mask, p)));
  }
#endif
  if (n >= lanes<Real>) return load<Real>(p);
  double values[lanes<Real>] = {};
  for (int lane = 0; lane < n; ++lane) values[lane] = p[lane];
  return load<Real>(values);
}

/// Bits of the first n lanes (all if n is larger).
template <class Real>
LAHAR_INLINE unsigned first_bits(Local n) {
  return n >= lanes<Real> ? (1u << lanes<Real>)-1 : (1u << n) - 1;
}

/// Store the first n lanes (all if n is larger); memory of the others is untouched.
template <class Real>
LAHAR_INLINE void store_first(const Real& value, double* p, Local n) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    const auto mask = static_cast<__mmask8>(n >= 8 ? 0xff : (1u << n) - 1);
    _mm512_mask_storeu_pd(p, mask, reinterpret_cast<__m512d>(value.v));
    return;
  }
#endif
  if (n >= lanes<Real>) {
    __builtin_memcpy(p, &value.v, sizeof(value.v));
    return;
  }
  for (int lane = 0; lane < n; ++lane) p[lane] = value[lane];
}

/// Store the lanes whose bit is set; memory of the others is untouched.
template <class Real>
LAHAR_INLINE void store_lanes(unsigned bits, const Real& value, double* p) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    _mm512_mask_storeu_pd(p, static_cast<__mmask8>(bits), __m512d(value.v));
    return;
  }
#endif
  for (int lane = 0; lane < lanes<Real>; ++lane)
    if (bits >> lane & 1) p[lane] = value[lane];
}

/// Sum of all lanes: halves are added pairwise, so the order is fixed.
template <int W>
LAHAR_INLINE double reduce(const PackOf<W>& value) {
  if constexpr (W == 1) {
    return value.v;
  } else {
    PackOf<W / 2> low, high;
    __builtin_memcpy(&low.v, &value.v, sizeof(low.v));
    __builtin_memcpy(&high.v, reinterpret_cast<const char*>(&value.v) + sizeof(low.v),
                     sizeof(low.v));
    return reduce(low + high);
  }
}

/// sums[k] = sum of all lanes of value[k]. Packs of eight lanes are added as a tree that shares its
/// shuffles between eight values; the order of additions is fixed.
template <int N, class Real>
LAHAR_INLINE void reduce_all(const Real (&value)[N], double (&sums)[N]) {
  if constexpr (lanes<Real> == 8 && N % 8 == 0) {
    using V = typename Real::Value;
    for (int first = 0; first < N; first += 8) {
      V pair[4], quad[2];
      for (int k = 0; k < 4; ++k) {
        const V a = value[first + 2 * k].v, b = value[first + 2 * k + 1].v;
        pair[k] = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14) +
                  __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
      }
      for (int k = 0; k < 2; ++k)
        quad[k] = __builtin_shufflevector(pair[2 * k], pair[2 * k + 1], 0, 1, 8, 9, 4, 5, 12, 13) +
                  __builtin_shufflevector(pair[2 * k], pair[2 * k + 1], 2, 3, 10, 11, 6, 7, 14, 15);
      store(Real::of(__builtin_shufflevector(quad[0], quad[1], 0, 1, 2, 3, 8, 9, 10, 11) +
                     __builtin_shufflevector(quad[0], quad[1], 4, 5, 6, 7, 12, 13, 14, 15)),
            sums + first);
    }
  } else {
    for (int k = 0; k < N; ++k) sums[k] = reduce(value[k]);
  }
}

/// rows[i] = lane i of the four values: a transposed block.
LAHAR_INLINE void transpose(const PackOf<8> (&value)[4], PackOf<4> (&rows)[8]) {
  using V = PackOf<8>::Value;
  const V even01 = __builtin_shufflevector(value[0].v, value[1].v, 0, 8, 2, 10, 4, 12, 6, 14);
  const V odd01 = __builtin_shufflevector(value[0].v, value[1].v, 1, 9, 3, 11, 5, 13, 7, 15);
  const V even23 = __builtin_shufflevector(value[2].v, value[3].v, 0, 8, 2, 10, 4, 12, 6, 14);
  const V odd23 = __builtin_shufflevector(value[2].v, value[3].v, 1, 9, 3, 11, 5, 13, 7, 15);
  const V two[4] = {__builtin_shufflevector(even01, even23, 0, 1, 8, 9, 2, 3, 10, 11),
                    __builtin_shufflevector(odd01, odd23, 0, 1, 8, 9, 2, 3, 10, 11),
                    __builtin_shufflevector(even01, even23, 4, 5, 12, 13, 6, 7, 14, 15),
                    __builtin_shufflevector(odd01, odd23, 4, 5, 12, 13, 6, 7, 14, 15)};
  // two[0] holds lanes 0 and 2, two[1] lanes 1 and 3, and so on.
  for (int k = 0; k < 4; ++k) {
    const int low = 4 * (k / 2) + k % 2;
    rows[low] = PackOf<4>::of(__builtin_shufflevector(two[k], two[k], 0, 1, 2, 3));
    rows[low + 2] = PackOf<4>::of(__builtin_shufflevector(two[k], two[k], 4, 5, 6, 7));
  }
}

/// Components smaller than `limit` in magnitude become zero; what is no number stays so.
template <class Real>
LAHAR_INLINE Real flushed(const Real& value, double limit) {
  const Real high(limit), low(-limit);
  return Real::of(((value.v < high.v) & (value.v > low.v)) ? Real(0.0).v : value.v);
}

template <class Real>
LAHAR_INLINE Real sqrt(const Real& value) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8)
    return Real::of(reinterpret_cast<typename Real::Value>(
        _mm512_maskz_sqrt_pd(0xff, reinterpret_cast<__m512d>(value.v))));
#endif
  double values[lanes<Real>];
  for (int lane = 0; lane < lanes<Real>; ++lane) values[lane] = std::sqrt(value[lane]);
  return load<Real>(values);
}

/// Natural logarithm, lane by lane.
template <class Real>
LAHAR_INLINE Real log(const Real& value) {
  double values[lanes<Real>];
  for (int lane = 0; lane < lanes<Real>; ++lane) values[lane] = std::log(value[lane]);
  return load<Real>(values);
}

/// 1 / x to eight digits at least, for x from 1e-300 to 1e300: an estimate of the machine and one
/// step of Newton's method. Packs of any width get the same.
template <class Real>
LAHAR_INLINE Real reciprocal_estimate(const Real& x) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    const auto y = Real::of(typename Real::Value(_mm512_maskz_rcp14_pd(0xff, __m512d(x.v))));
    return fma(y, fma(-x, y, Real(1.0)), y);
  } else {
    PackOf<8> wide(1.0);
    __builtin_memcpy(&wide.v, &x.v, sizeof(x.v));
    wide = reciprocal_estimate(wide);
    Real y;
    __builtin_memcpy(&y.v, &wide.v, sizeof(y.v));
    return y;
  }
#endif
  return 1.0 / x;
}

/// 1 / x to about one unit in the last place, at a third of a division's time; likewise.
template <class Real>
LAHAR_INLINE Real reciprocal(const Real& x) {
  const Real y = reciprocal_estimate(x);
#if defined(__AVX512F__)
  return fma(y, fma(-x, y, Real(1.0)), y);
#endif
  return y;
}

/// 1 / sqrt(x) likewise.
template <class Real>
LAHAR_INLINE Real inverse_sqrt(const Real& x) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    auto y = Real::of(typename Real::Value(_mm512_maskz_rsqrt14_pd(0xff, __m512d(x.v))));
    LAHAR_UNROLL
    for (int step = 0; step < 2; ++step) y = fma(Real(0.5 * y), fma(Real(-x * y), y, Real(1.0)), y);
    return y;
  } else {
    PackOf<8> wide(1.0);
    __builtin_memcpy(&wide.v, &x.v, sizeof(x.v));
    wide = inverse_sqrt(wide);
    Real y;
    __builtin_memcpy(&y.v, &wide.v, sizeof(y.v));
    return y;
  }
#endif
  return 1.0 / lahar::sqrt(x);
}

/// Bit per lane, of the first n: magnitude above `limit`, or not a number.
template <class Real>
LAHAR_INLINE unsigned outside(const Real& value, double limit, Local n) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) {
    const auto mask = static_cast<__mmask8>(n >= 8 ? 0xff : (1u << n) - 1);
    return _mm512_mask_cmp_pd_mask(mask, _mm512_abs_pd(reinterpret_cast<__m512d>(value.v)),
                                   _mm512_set1_pd(limit), _CMP_NLE_UQ);
  }
#endif
  unsigned bits = 0;
  for (int lane = 0; lane < lanes<Real> && lane < n; ++lane)
    if (!(std::abs(value[lane]) <= limit)) bits |= 1u << lane;
  return bits;
}

/// Lane by lane `x` where the lane's bit is set, `y` elsewhere.
template <class X, class Y>
LAHAR_INLINE PackIn<X, Y> select(unsigned bits, const X& x, const Y& y) {
  using Real = PackIn<X, Y>;
  const Real a(x), b(y);
  if constexpr (lanes<Real> == 1) {
    return bits & 1 ? a : b;
  } else {
#if defined(__AVX512F__)
    if constexpr (lanes<Real> == 8)
      return Real::of(typename Real::Value(
          _mm512_mask_blend_pd(static_cast<__mmask8>(bits), __m512d(b.v), __m512d(a.v))));
#endif
    decltype(a.v > b.v) of_lane;
    for (int lane = 0; lane < lanes<Real>; ++lane) of_lane[lane] = 1ll << lane;
    return Real::of((of_lane & static_cast<long long>(bits)) != 0 ? a.v : b.v);
  }
}

/// Bit per lane: x > y.
template <class X, class Y>
LAHAR_INLINE unsigned greater(const X& x, const Y& y) {
  using Real = PackIn<X, Y>;
  const Real a(x), b(y);
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8) return _mm512_cmp_pd_mask(__m512d(a.v), __m512d(b.v), _CMP_GT_OQ);
#endif
  unsigned bits = 0;
  for (int lane = 0; lane < lanes<Real>; ++lane)
    if (a[lane] > b[lane]) bits |= 1u << lane;
  return bits;
}

/// The larger of two values, lane by lane.
template <class X, class Y>
LAHAR_INLINE PackIn<X, Y> max(const X& x, const Y& y) {
  using Real = PackIn<X, Y>;
  const Real a(x), b(y);
  return Real::of(a.v > b.v ? a.v : b.v);
}

/// Magnitude, of numbers.
template <class Real>
LAHAR_INLINE Real abs(const Real& value) {
#if defined(__AVX512F__)
  if constexpr (lanes<Real> == 8)
    return Real::of(typename Real::Value(_mm512_abs_pd(__m512d(value.v))));
#endif
  return max(value, -value);
}

/// Values moved into [-limit, limit].
template <class Real>
LAHAR_INLINE Real clamp(const Real& value, double limit) {
  const Real high(limit), low(-limit);
  if constexpr (lanes<Real> == 1) {
    return Real(value.v > limit ? limit : value.v < -limit ? -limit : value.v);
  } else {
    auto v = value.v > high.v ? high.v : value.v;
    v = v < low.v ? low.v : v;
    return Real::of(v);
  }
}

}  // namespace lahar
