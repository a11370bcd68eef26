#pragma once
/// \file
/// Eight lanes that go through a tree with one ray (trace/group_walk.hpp), and what they find out together. On a device
/// they are threads of a warp, four groups to each. All four take every step together, those with nothing to do in it
/// too. Threads of a warp that part would go one group after the other. On a host one thread is all lanes of one group,
/// one after the other.

#include <gart/math/arith.hpp>

namespace gart { inline namespace GART_ISA {

/// Lanes of a group: one a child of a node.
inline constexpr int group_lanes = 8;

/// A value a lane.
template <class T>
struct group_values {
#if defined(__CUDA_ARCH__)
  T value;                                      ///< of the calling lane
  GART_HD T& operator[](int) { return value; }  ///< the same
#else
  T value[group_lanes];                                    ///< of each
  GART_HD T& operator[](int lane) { return value[lane]; }  ///< of one
#endif
};

#if defined(__CUDA_ARCH__)

/// The calling lane's number in its group.
__device__ GART_INLINE int lane_in_group() { return static_cast<int>(threadIdx.x) % group_lanes; }
/// The threads that take a step together.
inline constexpr u32 whole_warp = 0xffffffffu;

#endif

/// f(lane), for every lane.
template <class F>
GART_HD GART_INLINE void each_in_group(F&& f) {
#if defined(__CUDA_ARCH__)
  f(lane_in_group());
#else
  for (int lane = 0; lane < group_lanes; ++lane) f(lane);
#endif
}

/// What lanes wrote to the memory that they share is there for all of them.
GART_HD GART_INLINE void group_barrier() {
#if defined(__CUDA_ARCH__)
  __syncwarp();
#endif
}

/// Whether it is so in any group that takes the step.
GART_HD GART_INLINE bool in_any_group(bool so) {
#if defined(__CUDA_ARCH__)
  return __any_sync(whole_warp, so);
#else
  return so;
#endif
}

/// Whether it is so for any lane of any of them.
template <class F>
GART_HD GART_INLINE bool any_in_any_group(F&& f) {
#if defined(__CUDA_ARCH__)
  return __any_sync(whole_warp, f(lane_in_group()));
#else
  bool so = false;
  for (int lane = 0; lane < group_lanes; ++lane) so |= f(lane);
  return so;
#endif
}

/// The lanes for which it is true, a bit each.
template <class F>
GART_HD GART_INLINE u32 group_where(F&& f) {
#if defined(__CUDA_ARCH__)
  return __ballot_sync(whole_warp, f(lane_in_group())) >> (threadIdx.x % 32 / group_lanes * group_lanes) & 0xffu;
#else
  u32 bits = 0;
  for (int lane = 0; lane < group_lanes; ++lane) bits |= (f(lane) ? 1u : 0u) << lane;
  return bits;
#endif
}

/// The least of the lanes' numbers.
template <class F>
GART_HD GART_INLINE auto least_in_group(F&& f) {
#if defined(__CUDA_ARCH__)
  auto least = f(lane_in_group());
  GART_UNROLL
  for (int step = group_lanes / 2; step > 0; step /= 2) {
    auto const other = __shfl_xor_sync(whole_warp, least, step);
    least = other < least ? other : least;
  }
  return least;
#else
  auto least = f(0);
  for (int lane = 1; lane < group_lanes; ++lane) {
    auto const other = f(lane);
    least = other < least ? other : least;
  }
  return least;
#endif
}

/// The sum of the lanes' numbers.
template <class F>
GART_HD GART_INLINE auto sum_in_group(F&& f) {
#if defined(__CUDA_ARCH__)
  auto sum = f(lane_in_group());
  GART_UNROLL
  for (int step = group_lanes / 2; step > 0; step /= 2) sum += __shfl_xor_sync(whole_warp, sum, step);
  return sum;
#else
  auto sum = f(0);
  for (int lane = 1; lane < group_lanes; ++lane) sum += f(lane);
  return sum;
#endif
}

/// Gives one lane a value that all of them know.
template <class T>
GART_HD GART_INLINE void give_lane(group_values<T>& values, int lane, T const& value) {
#if defined(__CUDA_ARCH__)
  if (lane_in_group() == lane) values.value = value;
#else
  values.value[lane] = value;
#endif
}

/// The value of one lane.
template <class T>
GART_HD GART_INLINE T of_lane(group_values<T>& values, int lane) {
#if defined(__CUDA_ARCH__)
  return __shfl_sync(whole_warp, values.value, lane, group_lanes);
#else
  return values.value[lane];
#endif
}

}}  // namespace gart::GART_ISA
