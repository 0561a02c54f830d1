#pragma once

#include <bit>
#include <cstdint>

/// Numbers side by side. A kernel is a template over V: one double, or a vector of them of which
/// each lane is computed as that one double would be, to the bit: IEEE arithmetic, no fused
/// multiply-add, no approximate reciprocals. A source of lanes (treeroll_lanes in CMake) is
/// compiled once a width, with the instructions of that width, and chosen at run time. It includes
/// nothing but kernels: an inline function of a library that is compiled there would be shared with
/// sources that must run everywhere.
namespace treeroll::lanes {

using Double2 = double __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Double8 = double __attribute__((vector_size(64)));

template <class V>
struct BitsOf;
template <>
struct BitsOf<double> {
  using Type = std::uint64_t;
};
template <>
struct BitsOf<Double2> {
  using Type = std::uint64_t __attribute__((vector_size(16)));
};
template <>
struct BitsOf<Double4> {
  using Type = std::uint64_t __attribute__((vector_size(32)));
};
template <>
struct BitsOf<Double8> {
  using Type = std::uint64_t __attribute__((vector_size(64)));
};

/// As many unsigned 64-bit numbers as V has doubles.
template <class V>
using Bits = typename BitsOf<V>::Type;

template <class V>
inline constexpr int kWidth = sizeof(V) / sizeof(double);

/// What the sources of lanes are compiled for.
#ifdef TREEROLL_LANES
using Widest = double __attribute__((vector_size(8 * TREEROLL_LANES)));
#define TREEROLL_LANES_JOINED(name, width) name##_##width
#define TREEROLL_LANES_NAMED(name, width) TREEROLL_LANES_JOINED(name, width)
/// name_2, name_4 or name_8.
#define TREEROLL_LANES_NAME(name) TREEROLL_LANES_NAMED(name, TREEROLL_LANES)
#endif

#define TREEROLL_LANE_INLINE inline __attribute__((always_inline))
#define TREEROLL_LANE_LAMBDA __attribute__((always_inline))

template <class To, class From>
TREEROLL_LANE_INLINE To bits_as(From from) {
  return std::bit_cast<To>(from);
}

/// The same number in every lane.
template <class V>
TREEROLL_LANE_INLINE V all(double number) {
  return V{} + number;
}

template <class V>
TREEROLL_LANE_INLINE V load(const double* numbers) {
  V v;
  __builtin_memcpy(&v, numbers, sizeof v);
  return v;
}

template <class V>
TREEROLL_LANE_INLINE void store(V v, double* numbers) {
  __builtin_memcpy(numbers, &v, sizeof v);
}

/// `if_set` where the mask is all ones, `if_clear` where it is zero.
template <class V>
TREEROLL_LANE_INLINE V select(Bits<V> mask, V if_set, V if_clear) {
  return bits_as<V>((mask & bits_as<Bits<V>>(if_set)) | (~mask & bits_as<Bits<V>>(if_clear)));
}

/// The larger and the smaller; `a` if one of the two is NaN.
template <class V>
TREEROLL_LANE_INLINE V larger(V a, V b) {
  return a < b ? b : a;
}

template <class V>
TREEROLL_LANE_INLINE V smaller(V a, V b) {
  return b < a ? b : a;
}

}  // namespace treeroll::lanes
