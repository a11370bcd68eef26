#pragma once
/// \file
/// Places for the hits of rays before anybody knows how many they are. So one walk finds hits and writes them. A ray
/// takes a run of places at a time. It says whose the run is and where in the ray it begins. Counts say afterwards
/// where in the order of the rays each hit belongs. Where there are more hits than places, the rest is counted, not
/// written.
///
/// Memory: 8 bytes a run of 16 places, and 4 a ray. Most rays leave a part of their last run empty.

#include <gart/exec/buffer.hpp>
#include <gart/trace/lane_group.hpp>

namespace gart { inline namespace GART_ISA {

/// Places of a run.
inline constexpr u32 hit_run = 16;
static_assert(hit_run >= group_lanes);

/// The runs as kernels write them.
template <execution E>
struct run_writer {
  /// Of a ray: its next place, and how many it has left.
  struct state {
    u64 at = 0;    ///< place
    u32 left = 0;  ///< places
  };
  u32* rays = nullptr;    ///< [places / hit_run]: whose it is
  u32* firsts = nullptr;  ///< [places / hit_run]: the number in its ray of the first hit
  u32* counts = nullptr;  ///< [R]: hits of the rays
  u64* used = nullptr;    ///< places that rays have taken
  u64 places = 0;         ///< a multiple of hit_run

  /// f(place) for the hit of number k of a ray, where there is a place.
  GART_KERNEL GART_INLINE void put(state& s, index_t ray_number, u32 k, auto const& f) const {
    if (s.left == 0) s.at = take_run(ray_number, k), s.left = hit_run;
    if (s.at < places) f(s.at);
    ++s.at, --s.left;
  }
  /// f(lane, place) for as many hits of a ray, from number `first`, a lane each (trace/lane_group.hpp).
  GART_KERNEL GART_INLINE void put_together(state& s, index_t ray_number, u32 first, u32 count, auto const& f) const {
    bool const runs_out = count > s.left;
    group_values<u64> taken;
    each_in_group([&](int l) {
      taken[l] = 0;
      if (l == 0 && runs_out) taken[l] = take_run(ray_number, first + s.left);
    });
    u64 const next = of_lane(taken, 0) - s.left;  // as if it followed on
    each_in_group([&](int l) {
      u32 const k = static_cast<u32>(l);
      u64 const at = (k < s.left ? s.at : next) + k;
      if (k < count && at < places) f(l, at);
    });
    s.at = (runs_out ? next : s.at) + count;
    s.left = s.left + (runs_out ? hit_run : 0) - count;
  }

 private:
  GART_KERNEL GART_INLINE u64 take_run(index_t ray_number, u32 first) const {
    u64 const at = E::atomic_add(used, u64{hit_run});
    if (at < places) rays[at / hit_run] = ray_number, firsts[at / hit_run] = first;
    return at;
  }
};

/// The runs as kernels read them, with the counts of hits and their sums.
struct run_reader {
  u32 const *rays, *firsts, *counts;  ///< as run_writer has them
  u64 const* offsets;                 ///< [R]: hits of the rays before

  /// Whose a place is.
  GART_HD GART_INLINE u32 ray_of(u32 place) const { return rays[place / hit_run]; }
  /// Whether a place that was taken holds a hit; whose, and which of all in the order of the rays.
  GART_HD GART_INLINE bool find(index_t place, u32& ray_number, u64& at) const {
    ray_number = ray_of(place);
    u32 const k = firsts[place / hit_run] + place % hit_run;
    at = offsets[ray_number] + k;
    return k < counts[ray_number];
  }
};

/// The memory of the runs.
template <execution E>
struct hit_runs {
  /// None yet; allocates nothing. `exec` must outlive it.
  explicit hit_runs(E& exec) : rays(exec), firsts(exec), counts(exec), used(exec) {}

  buffer<u32, E> rays, firsts, counts;  ///< as run_writer has them
  buffer<u64, E> used;                  ///< [2]: as run_writer has it; for the number of hits

  /// How many places to begin with, where as many rays took so many on average before.
  static u64 room_for(index_t of_rays, double each) {
    return static_cast<u64>(each * of_rays * 1.125) / hit_run * hit_run + hit_run;
  }
  /// Empty ones; places: a multiple of hit_run.
  run_writer<E> begin(index_t of_rays, u64 places) {
    rays.resize(places / hit_run), firsts.resize(places / hit_run);
    counts.resize(of_rays), used.resize(2);
    used.zero();
    return {rays.data(), firsts.data(), counts.data(), used.data(), places};
  }
  /// What was written, where `offsets` are those of the counts.
  run_reader read(u64 const* offsets) const { return {rays.data(), firsts.data(), counts.data(), offsets}; }
};

}}  // namespace gart::GART_ISA
