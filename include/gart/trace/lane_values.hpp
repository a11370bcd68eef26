#pragma once
/// \file
/// The values of the 32 lanes of a beam (trace/beam_walk.hpp), and what they find out together. On a device a lane is a
/// thread of a warp with its own value in registers. On a host one thread is all lanes, one after the other.

#include <gart/math/arith.hpp>

namespace gart { inline namespace GART_ISA {

/// Lanes of a beam, a ray each.
inline constexpr int beam_lanes = 32;

/// A value a lane, made by f(lane) of each_lane; not constructed before.
template <class T>
class per_lane {
  union own {
    T value;
    GART_HD own() {}
  };

 public:
  GART_HD per_lane() {}
  /// Of one lane; on a device of the calling one.
#if defined(__CUDA_ARCH__)
  GART_HD T& operator[](int) { return own_.value; }

 private:
  own own_;
#else
  GART_HD T& operator[](int lane) { return own_[lane].value; }

 private:
  own own_[beam_lanes];
#endif
};

/// f(lane), for every lane.
template <class F>
GART_HD GART_INLINE void each_lane(F&& f) {
#if defined(__CUDA_ARCH__)
  f(static_cast<int>(threadIdx.x));
#else
  for (int lane = 0; lane < beam_lanes; ++lane) f(lane);
#endif
}

/// The lanes for which it is true, a bit each.
template <class F>
GART_HD GART_INLINE u32 lanes_where(F&& f) {
#if defined(__CUDA_ARCH__)
  return __ballot_sync(0xffffffffu, f(static_cast<int>(threadIdx.x)));
#else
  u32 bits = 0;
  for (int lane = 0; lane < beam_lanes; ++lane) bits |= (f(lane) ? 1u : 0u) << lane;
  return bits;
#endif
}

/// The least number of any lane.
template <class F>
GART_HD GART_INLINE u32 least_word(F&& f) {
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ >= 800
  return __reduce_min_sync(0xffffffffu, f(static_cast<int>(threadIdx.x)));
#else
  u32 least = 0xffffffffu;
  for (int lane = 0; lane < beam_lanes; ++lane) {
    u32 const x = f(lane);
    least = x < least ? x : least;
  }
  return least;
#endif
}

/// The same of floats: their bits, turned so that words have their order.
template <class F>
GART_HD GART_INLINE float least_of_lanes(F&& f) {
  u32 const bits = least_word([&](int lane) {
    u32 const x = float_to_bits(f(lane));
    return x & 0x80000000u ? ~x : x | 0x80000000u;
  });
  return bits_to_float(bits & 0x80000000u ? bits & 0x7fffffffu : ~bits);
}
/// The greatest.
template <class F>
GART_HD GART_INLINE float greatest_of_lanes(F&& f) {
  return -least_of_lanes([&](int lane) { return -f(lane); });
}

/// How many bits are set.
GART_HD GART_INLINE int count_bits(u32 bits) {
#if defined(__CUDA_ARCH__)
  return __popc(bits);
#else
  return __builtin_popcount(bits);
#endif
}
/// Of a word, the bits of the lanes before one.
GART_HD GART_INLINE u32 bits_before(u32 bits, int lane) { return bits & ((1u << lane) - 1u); }

}}  // namespace gart::GART_ISA
