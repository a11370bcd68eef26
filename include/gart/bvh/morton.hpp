#pragma once
/// \file
/// Morton codes of 63 bits: 21 bits an axis, interleaved, so that neighbours in the code are neighbours in space.

#include <gart/bvh/box.hpp>

namespace gart { inline namespace GART_ISA {

/// Of a code: 21 an axis.
inline constexpr int morton_bits = 63;

/// The low 21 bits of x, two bits of zero after each.
GART_HD GART_INLINE u64 spread_bits(u64 x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  x = (x | x << 2) & 0x1249249249249249ull;
  return x;
}

/// Code of a point in `bounds`; points outside (or not numbers) go to its edge.
GART_HD GART_INLINE u64 morton_code(vec3 const& p, box const& bounds) {
  u64 code = 0;
  for (int k = 0; k < 3; ++k) {
    float const size = bounds.hi[k] - bounds.lo[k];
    float u = size > 0 ? (p[k] - bounds.lo[k]) / size * 2097152.0f : 0.0f;
    u = u > 0.0f ? u : 0.0f;
    u = u < 2097151.0f ? u : 2097151.0f;
    code |= spread_bits(static_cast<u64>(u)) << k;
  }
  return code;
}

}}  // namespace gart::GART_ISA
