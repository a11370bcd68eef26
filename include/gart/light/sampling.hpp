#pragma once
/// \file
/// Numbers that paths are drawn by, and what directions are made of them. Numbers are Sobol's first two dimensions,
/// shuffled and scrambled for each pixel and use (Burley, "Practical hash-based Owen scrambling", JCGT 2020). They are
/// integers throughout, so every policy draws the same. Angles go through polynomials, for the same bits in what
/// follows.

#include <gart/core/macros.hpp>
#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>
#include <gart/math/optics.hpp>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

constexpr float pi = 3.14159265f;

GART_HD GART_INLINE float luminance(vec3 const& c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
GART_HD GART_INLINE float largest(vec3 const& c) { return fmaxf(c.x, fmaxf(c.y, c.z)); }
GART_HD GART_INLINE float clamped(float x, float lo, float hi) { return fminf(fmaxf(x, lo), hi); }
GART_HD GART_INLINE vec3 mixed(vec3 const& a, vec3 const& b, float part) { return a * (1.0f - part) + b * part; }

GART_HD GART_INLINE u32 hashed(u32 x) {
  x ^= x >> 16, x *= 0x21f0aaadu, x ^= x >> 15, x *= 0xd35a2d97u, x ^= x >> 15;
  return x;
}
GART_HD GART_INLINE u32 hashed(u32 a, u32 b) { return hashed(a ^ (hashed(b) + 0x9e3779b9u + (a << 6) + (a >> 2))); }

GART_HD GART_INLINE u32 reversed(u32 x) {
  x = x << 16 | x >> 16;
  x = (x & 0x00ff00ffu) << 8 | (x & 0xff00ff00u) >> 8;
  x = (x & 0x0f0f0f0fu) << 4 | (x & 0xf0f0f0f0u) >> 4;
  x = (x & 0x33333333u) << 2 | (x & 0xccccccccu) >> 2;
  return (x & 0x55555555u) << 1 | (x & 0xaaaaaaaau) >> 1;
}
// Laine and Karras' permutation with Vegdahl's constants: each bit is flipped by those above it.
GART_HD GART_INLINE u32 scrambled(u32 x, u32 seed) {
  x = reversed(x);
  x ^= x * 0x3d20adeau, x += seed, x *= (seed >> 16) | 1u, x ^= x * 0x05526c56u, x ^= x * 0x53a22864u;
  return reversed(x);
}

// [0, 1), 24 bits.
GART_HD GART_INLINE float unit_interval(u32 word) { return static_cast<float>(word >> 8) * 0x1p-24f; }

// What numbers are drawn for: one pair each, and one more a light.
enum draw_use : u32 { draw_pixel, draw_lens, draw_direction, draw_lobe, draw_environment, draw_light = 16 };

// The pairs of one sample of one pixel.
struct draws {
  u32 seed = 0, sample = 0;

  GART_HD GART_INLINE static draws of(u64 seed, u32 pixel, u32 sample) {
    return {hashed(hashed(static_cast<u32>(seed), static_cast<u32>(seed >> 32)), pixel), sample};
  }
  GART_HD GART_INLINE vec2 pair(u32 step, u32 use) const {
    u32 const s = hashed(seed, step << 12 | use), i = scrambled(sample, s);
    u32 second = 0;
    for (u32 left = i, v = 0x80000000u; left != 0; left >>= 1, v ^= v >> 1)
      if (left & 1u) second ^= v;
    return {unit_interval(scrambled(reversed(i), hashed(s, 1))), unit_interval(scrambled(second, hashed(s, 2)))};
  }
};

// Cosine and sine of u turns, u in [0, 1]; within 4e-7.
GART_HD GART_INLINE vec2 turn_of(float u) {
  float const quarters = 4.0f * u, nearest = floorf(quarters + 0.5f);
  float const r = (quarters - nearest) * 1.57079633f, r2 = r * r;
  float const sine = r * (1.0f + r2 * (-1.6666667e-1f + r2 * (8.3333310e-3f + r2 * -1.9840874e-4f)));
  float const cosine = 1.0f + r2 * (-0.5f + r2 * (4.1666657e-2f + r2 * (-1.3888397e-3f + r2 * 2.4609567e-5f)));
  switch (static_cast<int>(nearest) & 3) {
    case 0:
      return {cosine, sine};
    case 1:
      return {-sine, cosine};
    case 2:
      return {-cosine, -sine};
    default:
      return {sine, -cosine};
  }
}

// The angle of (x, y) in turns, [0, 1); within 2e-7.
GART_HD GART_INLINE float turns_of(float x, float y) {
  float const a = fabsf(x), b = fabsf(y), small = fminf(a, b), large = fmaxf(a, b);
  if (large == 0) return 0;
  float const q = small / large, q2 = q * q;
  float p = -0.0040540580f;
  p = p * q2 + 0.0218612288f;
  p = p * q2 - 0.0559098861f;
  p = p * q2 + 0.0964200441f;
  p = p * q2 - 0.1390853351f;
  p = p * q2 + 0.1994653599f;
  p = p * q2 - 0.3332985605f;
  p = p * q2 + 0.9999993329f;
  float angle = q * p * 0.159154943f;
  if (b > a) angle = 0.25f - angle;
  if (x < 0) angle = 0.5f - angle;
  if (y < 0) angle = 1.0f - angle;
  return angle < 1.0f ? angle : 0.0f;
}

// A point of the unit disk, equally likely anywhere; squares become sectors (Shirley and Chiu).
GART_HD GART_INLINE vec2 in_disk(vec2 const& u) {
  float const a = 2.0f * u.x - 1.0f, b = 2.0f * u.y - 1.0f;
  if (a == 0 && b == 0) return {0.0f, 0.0f};
  bool const wide = fabsf(a) > fabsf(b);
  float const r = wide ? a : b, eighths = 0.125f * (wide ? b / a : 2.0f - a / b);
  return r * turn_of(eighths < 0 ? eighths + 1.0f : eighths);
}

// Two axes that make a frame with n (Duff et al., "Building an orthonormal basis, revisited", JCGT 2017).
struct axes {
  vec3 x, y, z;
  GART_HD GART_INLINE explicit axes(vec3 const& n) : z(n) {
    float const sign = n.z < 0 ? -1.0f : 1.0f, a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    x = {1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x};
    y = {b, sign + n.y * n.y * a, -n.y};
  }
  GART_HD GART_INLINE vec3 to_local(vec3 const& v) const { return {glm::dot(v, x), glm::dot(v, y), glm::dot(v, z)}; }
  GART_HD GART_INLINE vec3 to_world(vec3 const& v) const { return x * v.x + y * v.y + z * v.z; }
};

// About z, by the cosine.
GART_HD GART_INLINE vec3 cosine_direction(vec2 const& u) {
  vec2 const d = in_disk(u);
  return {d.x, d.y, square_root(fmaxf(0.0f, 1.0f - d.x * d.x - d.y * d.y))};
}

// Equally likely in the cone about z where 1 - cosine is at most `rise`.
GART_HD GART_INLINE vec3 cone_direction(vec2 const& u, float rise) {
  float const down = u.x * rise, sine = square_root(fmaxf(0.0f, down * (2.0f - down)));
  vec2 const turn = turn_of(u.y);
  return {sine * turn.x, sine * turn.y, 1.0f - down};
}

// How much one of two ways to draw a direction counts (Veach's power heuristic).
GART_HD GART_INLINE float balance(float mine, float other) {
  float const ratio = other / mine;
  return 1.0f / (1.0f + ratio * ratio);
}

}}}  // namespace gart::GART_ISA::light_kernels
