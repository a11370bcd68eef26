#pragma once
/// \file
/// The hits of a packet's rays that are found and not yet passed on (trace/packet_walk.hpp). Row r has hit r of each
/// ray, in the order of (t, id). A row holds distances, and where the rest of each hit is kept. The rest is kept by
/// Gaussian, since its hits are found and shaded together. A hit is put in its place from the last row on: most are
/// farther than most that wait.
///
/// Memory: 256 rows, 1,024 Gaussians; what is not used is not touched. Cost: hits of a Gaussian take a comparison and
/// four blends a row that they go before. A row that is passed on takes two blends a row behind it, unless all rays go.

#include <gart/math/lanes.hpp>

#include <cstddef>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// The rest of a hit a lane. Shown: an array of lanes.
template <class Shown>
struct waiting_hits {
  lanes alpha;        ///< of the hits
  Shown shown;        ///< what the Gaussians show the rays (trace/packet_program.hpp)
  lane_words places;  ///< what the program told the hits apart by
};

/// The rows of a packet.
template <class Shown>
class packet_rows {
 public:
  /// Empties them; to be called first.
  void clear() { first_ = rows_ = 0, used_ = free_count_ = 0, room_ = least_room, end_here(); }

  /// Rows that have a hit.
  int size() const { return rows_; }
  /// t of the nearest hit of each ray.
  lanes nearest() const { return t_[first_]; }
  /// The rays that have a hit.
  lane_mask filled() const { return t_[first_] < lanes(none); }

  /// Takes the hits of a Gaussian with `rays`, at least one. fill(waiting_hits&) makes the rest of them. False: there
  /// is no room.
  template <class Fill>
  GART_INLINE bool insert(lanes t, lane_mask rays, u32 id, Fill const& fill) {
    if (used_ == room_ && free_count_ == 0 && !reclaim()) return false;
    if (rows_ == 0 || any(rays & (t_[last()] < lanes(none)))) {
      if (rows_ == most_rows) return false;
      if (first_ + rows_ == most_rows) move_to_front();
      ++rows_, end_here();
    }
    u32 const to = used_ < room_ ? used_++ : free_[--free_count_];
    fill(kept_[to]), ids_[to] = id;
    lane_words const mine = every_lane(to);
    lane_mask here = rays;  // those whose hits come before row r + 1: row r changes
    int r = last();
    for (; r > first_; --r) {
      lane_mask const nearer = here & before(t, id, r - 1, here);
      t_[r] = select(here, select(nearer, t_[r - 1], t), t_[r]);
      at_[r] = select(here, select(nearer, at_[r - 1], mine), at_[r]);
      here = nearer;
      if (!any(here)) return true;
    }
    t_[r] = select(here, t, t_[r]), at_[r] = select(here, mine, at_[r]);
    return true;
  }

  /// The rest of the nearest hits of `rays`, at least one; all of them have one.
  GART_INLINE waiting_hits<Shown> nearest_hits(lane_mask rays) const {
    lane_words const at = at_[first_];
    u32 const one = at[__builtin_ctz(bits_of(rays))];
    if (!any(rays & ~equal(at, every_lane(one)))) return kept_[one];  // of one Gaussian: nothing to gather
    constexpr u32 stride = sizeof(waiting_hits<Shown>) / sizeof(float);
    lane_words own;
    for (int l = 0; l < lane_count; ++l) own[l] = static_cast<u32>(l);
    lane_words const from = at * stride + own;
    waiting_hits<Shown> h;
    h.alpha = gather(&kept_[0].alpha, from), h.places = gather(&kept_[0].places, from);
    for (std::size_t k = 0; k < h.shown.size(); ++k) h.shown[k] = gather(&kept_[0].shown[k], from);
    return h;
  }

  /// Takes the nearest hit off `rays`.
  GART_INLINE void pop(lane_mask rays) {
    if (!any(filled() & ~rays)) {
      ++first_, --rows_;
      return;
    }
    for (int r = first_; r <= last(); ++r)
      t_[r] = select(rays, t_[r + 1], t_[r]), at_[r] = select(rays, at_[r + 1], at_[r]);
    drop_empty();
  }
  /// Takes all hits off `rays`.
  void empty(lane_mask rays) {
    for (int r = first_; r <= last(); ++r) t_[r] = select(rays, lanes(none), t_[r]);
    drop_empty();
  }

 private:
  static constexpr int most_rows = 256;
  static constexpr u32 most_kept = 1024, least_room = 64;
  static constexpr float none = 3.402823466e38f;  // t of no hit

  int last() const { return first_ + rows_ - 1; }

  // Whether a hit comes before that of a row: of two at one t, the lower id.
  GART_INLINE lane_mask before(lanes t, u32 id, int row, lane_mask rays) const {
    lane_mask less = t < t_[row];
    lane_mask const same = rays & (t == t_[row]);
    if (any(same)) [[unlikely]]
      for (u32 left = bits_of(same); left; left &= left - 1)
        if (int const l = __builtin_ctz(left); id < ids_[at_[row][l]]) less |= lanes_of(1u << l);
    return less;
  }

  // Behind the last row is one without hits.
  void end_here() { t_[last() + 1] = lanes(none), at_[last() + 1] = every_lane(0); }

  void drop_empty() {
    while (rows_ > 0 && !any(t_[last()] < lanes(none))) --rows_;
  }

  // Rows that were passed on left room before the others.
  void move_to_front() {
    for (int r = 0; r <= rows_; ++r) t_[r] = t_[first_ + r], at_[r] = at_[first_ + r];  // and the one behind them
    first_ = 0;
  }

  // Frees what is kept of hits that were passed on. Where most of it is needed there is more room from now on: not at
  // once, since less room stays in the cache.
  bool reclaim() {
    bool waits[most_kept] = {};
    for (int r = first_; r <= last(); ++r)
      for (u32 left = bits_of(t_[r] < lanes(none)); left; left &= left - 1) waits[at_[r][__builtin_ctz(left)]] = true;
    for (u32 k = 0; k < used_; ++k)
      if (!waits[k]) free_[free_count_++] = static_cast<u16>(k);
    if (free_count_ < used_ / 4 && room_ < most_kept) room_ *= 2;
    return used_ < room_ || free_count_ > 0;
  }

  int first_ = 0, rows_ = 0;
  lanes t_[most_rows + 1];
  lane_words at_[most_rows + 1];  // in kept_

  u32 used_ = 0, free_count_ = 0, room_ = least_room;  // of kept_, and of free_
  waiting_hits<Shown> kept_[most_kept];
  u32 ids_[most_kept];  // of their Gaussians
  u16 free_[most_kept];
};

}}  // namespace gart::GART_ISA

#endif
