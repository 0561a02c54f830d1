#pragma once

#include "common/numbers/lanes.h"

/// sin, cos and exp as kernels over lanes. Less than one unit in the last place from the true value
/// (.77, .79 and .95 measured against 64-bit mantissas): half of it is the last rounding.
///
/// Coefficients: minimax in the relative error of the function, by Remez exchange in 50 digits,
/// then rounded.
namespace treeroll::elementary {

/// sin_cos() is for arguments up to here; with larger ones the reduction would lose digits.
inline constexpr double kSinCosMax = 2048;

namespace kernel {

using lanes::all;
using lanes::Bits;
using lanes::bits_as;

/// Adding it rounds to an integer, which then stands in the low bits.
inline constexpr double kRounder = 0x1.8p52;

/// Precondition: every |x| <= kSinCosMax. sin(-0) is +0.
template <class V>
TREEROLL_LANE_INLINE void sin_cos(V x, V& sin, V& cos) {
  // x = quarter pi / 2 + angle + tail, |angle| <= pi / 4. pi / 2 in three parts: the first two have
  // 33 bits, so that their products with quarter are exact.
  const V shifted = x * 0x1.45f306dc9c883p-1 + kRounder;
  const Bits<V> quarter_bits = bits_as<Bits<V>>(shifted);
  const V quarter = shifted - kRounder;
  const V first = x - quarter * 0x1.921fb544p0;
  const V second = quarter * 0x1.0b4611a6p-34;
  const V reduced = first - second;
  const V lost = ((first - reduced) - second) - quarter * 0x1.3198a2e037073p-69;
  const V angle = reduced + lost;
  const V tail = (reduced - angle) + lost;

  const V z = angle * angle;
  const V z2 = z * z;
  // sin(a) = a + a^3 S(a^2), cos(a) = 1 - a^2 / 2 + a^4 C(a^2), and what the tail adds to both.
  const V s = (-0x1.5555555555548p-3 + z * 0x1.111111110f7d0p-7) +
              z2 * ((-0x1.a01a019bfddafp-13 + z * 0x1.71de3567c16d8p-19) +
                    z2 * (-0x1.ae5e5a83160f8p-26 + z * 0x1.5d8fcd5b93045p-33));
  const V c = (0x1.555555555554bp-5 + z * -0x1.6c16c16c14f91p-10) +
              z2 * ((0x1.a01a019c843c2p-16 + z * -0x1.27e4f7eab68d1p-22) +
                    z2 * (0x1.1ee9d7ab08b58p-29 + z * -0x1.8fa494d192e63p-37));
  const V half = .5 * z;
  const V below_one = 1. - half;
  const V of_sin = angle + ((z * angle) * s + tail * below_one);
  const V of_cos = below_one + (((1. - below_one) - half) + (z2 * c - angle * tail));

  // An odd quarter changes the two; the second bit changes the sign.
  const Bits<V> is_odd = -(quarter_bits & 1);
  const Bits<V> sin_sign = (quarter_bits & 2) << 62;
  const Bits<V> cos_sign = ((quarter_bits + 1) & 2) << 62;
  sin = bits_as<V>(bits_as<Bits<V>>(lanes::select(is_odd, of_cos, of_sin)) ^ sin_sign);
  cos = bits_as<V>(bits_as<Bits<V>>(lanes::select(is_odd, of_sin, of_cos)) ^ cos_sign);
}

/// For every x: infinite from 709.8 on, 0 below -745.2, NaN for NaN.
template <class V>
TREEROLL_LANE_INLINE V exp(V x) {
  // In this order NaN passes both.
  const V bounded = lanes::smaller(lanes::larger(x, all<V>(-746.)), all<V>(710.));
  // x = power ln 2 + rest, |rest| <= ln 2 / 2. The first part of ln 2 has 42 bits.
  const V shifted = bounded * 0x1.71547652b82fep0 + kRounder;
  const Bits<V> power_bits = bits_as<Bits<V>>(shifted) - bits_as<std::uint64_t>(kRounder);
  const V power = shifted - kRounder;
  const V rest = (bounded - power * 0x1.62e42fefa38p-1) - power * 0x1.ef35793c76730p-45;

  // exp(r) = 1 + r + r^2 / 2 + r^3 R(r).
  const V r2 = rest * rest;
  const V r4 = r2 * r2;
  const V r = ((0x1.5555555555501p-3 + rest * 0x1.5555555553207p-5) +
               r2 * (0x1.111111112887bp-7 + rest * 0x1.6c16c17cc33fbp-10)) +
              r4 * (((0x1.a01a011c229eap-13 + rest * 0x1.a019ab2d005f1p-16) +
                     r2 * (0x1.71df55423968ep-19 + rest * 0x1.289f8b144c2f9p-22)) +
                    r4 * 0x1.ad201648c2119p-26);
  const V of_rest = 1. + (rest + (r2 * .5 + (r2 * rest) * r));

  // 2^power in two factors, as it may be past what one exponent holds; the shift is of a number
  // that is not negative.
  const Bits<V> first = ((power_bits + 2048) >> 1) - 1024;
  const Bits<V> second = power_bits - first;
  return of_rest * bits_as<V>((first + 1023) << 52) * bits_as<V>((second + 1023) << 52);
}

}  // namespace kernel
}  // namespace treeroll::elementary
