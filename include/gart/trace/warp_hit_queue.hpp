#pragma once
/// \file
/// The pending hits of one ray of a warp (trace/warp_walk.hpp), in the order (t, id). The latest 15 lie in a window in
/// shared memory, where each lane has a bank of its own. Their order is a register of 4-bit numbers. A full window is
/// spilled, all but its first hit, as a run, in order, to its own memory. For each run the next hit's t is in a
/// register. The next hit of all is the window's first or that of a run. So a hit is spilled once at most, and the
/// order of others is never made anew for it.
///
/// Where all runs are taken a hit is lost. Hits passed on from then on lie before the nearest lost one.
/// Memory: 24 bytes for each of 196 hits a lane. Device only.

#include <gart/core/types.hpp>
#include <gart/exec/kept_address.hpp>
#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>

#if defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// A hit that waits for its turn.
struct waiting_hit {
  float t,     ///< distance along the ray
      alpha;   ///< opacity of the hit
  vec3 shown;  ///< what it shows (trace/warp_program.hpp)
  u32 key;     ///< a hit's place where hits have places (trace/warp_program.hpp), else its Gaussian's entry in the list
};

/// The order of hits at one t. Places of a pixel's hits are in the order of their ids. Entries are asked for their ids.
struct place_order {
  /// By number.
  GART_HD GART_INLINE bool operator()(u32 a, u32 b) const { return a < b; }
};
/// The ids that entries of the list stand for.
struct entry_order {
  u32 const* ids;  ///< the list
  /// By id.
  GART_HD GART_INLINE bool operator()(u32 a, u32 b) const { return ids[a] < ids[b]; }
};

/// The queue of one ray, a lane a ray.
template <class KeyOrder>
class warp_hit_queue {
  static constexpr int lanes = 32;
  static constexpr int window = 15;  // as many as `order_` has room for
  static constexpr int run = window - 1, runs = 14;
  static_assert(run < 16 && runs < 16);  // `left_` has 4 bits a run; free_run: some of them are always zero
  static constexpr float infinity = __builtin_huge_valf();
  // Slots are numbered from 1. Of slot 0 there is a t alone, less than that of any hit.
  static constexpr int no_slot = 0;
  static constexpr u32 every_slot = ((1u << window) - 1) << 1;

  struct alignas(8) pair {
    float a, b;
  };

 public:
  /// What a warp shares.
  struct scratch {
    float words[1 + 6 * window][lanes];  ///< of the waiting hits, a bank a lane
  };
  static constexpr std::size_t spill_floats_a_lane = std::size_t{6} * runs * run;  ///< of a lane

  /// spill_memory: of the warp's lanes, on a boundary of 8 bytes.
  __device__ GART_INLINE warp_hit_queue(scratch& s, float* spill_memory, int lane, KeyOrder before)
      : own_(&detail::kept_address<float>(&s.words[0][lane])),
        spilled_(reinterpret_cast<pair*>(spill_memory + spill_floats_a_lane * lane)),
        before_(before) {
    word(time, no_slot) = -infinity;
    clear();
  }

  /// Empties it.
  __device__ GART_INLINE void clear() {
    order_ = 0, free_ = every_slot, count_ = 0;
    left_ = 0, next_t_ = infinity, next_run_ = 0;
    lost_t_ = infinity, lost_key_ = 0;
    GART_UNROLL
    for (int r = 0; r < runs; ++r) first_t_[r] = infinity;
  }

  /// Whether the window has no room left.
  __device__ GART_INLINE bool full() const { return count_ == window; }
  /// Hits that the window still has room for.
  __device__ GART_INLINE int room() const { return window - count_; }
  /// Whether a hit was lost since clear().
  __device__ GART_INLINE bool lost() const { return lost_t_ < infinity; }
  __device__ GART_INLINE float lost_t() const { return lost_t_; }  ///< infinity: none

  /// Spills a window that is full, and one that soon will be. So lanes spill together, without divergence.
  __device__ GART_INLINE void make_room() {
    if (count_ < window - 3) return;
    int const to = free_run();
    if (to < runs) spill(to);
  }

  /// Needs room, where there can be.
  __device__ GART_INLINE void add(waiting_hit const& h) {
    int slot = free_slot();
    if (lost() | full()) {
      if (!has_place(h)) return;
      slot = free_slot();
    }
    put(h, slot);
  }

  /// Passes on hits with t * cosine < depth until f(hit) is false.
  template <class F>
  __device__ GART_INLINE void pass_on(float depth, float cosine, F&& f) {
    while (true) {
      int const slot = slot_from_back((count_ - 1) & 15);
      waiting_hit const first = at(slot);  // all of it, taken or not: shared memory is waited for once
      float t = count_ > 0 ? first.t : infinity;
      bool from_run = false;
      if ((next_t_ < infinity) & (next_t_ <= t)) from_run = next_t_ < t || before_(key_of(next_spilled()), first.key);
      t = from_run ? next_t_ : t;
      if ((t == infinity) | !(t * cosine < depth)) return;
      if (t >= lost_t_ && !nearer(t, from_run ? key_of(next_spilled()) : first.key, lost_t_, lost_key_)) return;
      if (!from_run) order_ &= ~(u64{15} << (4 * (count_ - 1))), give_back(slot);
      if (!f(from_run ? take_of_run() : first)) return;
    }
  }

 private:
  enum field { time, opacity, red, green, blue, key_bits };

  // Of the hit in a slot of the window.
  __device__ GART_INLINE float& word(field f, int slot) const { return own_[(f * window + slot) * lanes]; }
  __device__ GART_INLINE u32 key_at(int slot) const { return float_to_bits(word(key_bits, slot)); }

  __device__ GART_INLINE bool nearer(float t, u32 key, float other_t, u32 other) const {
    return t != other_t ? t < other_t : before_(key, other);
  }

  // The slot of the window's hit that has k behind it; without one no_slot.
  __device__ GART_INLINE int slot_from_back(int k) const { return static_cast<int>(order_ >> (4 * k)) & 15; }

  // Whether there is a place for this hit, where one was lost or the window is full. It must lie nearer than all lost
  // hits.
  __device__ GART_INLINE bool has_place(waiting_hit const& h) {
    if (lost() && !nearer(h.t, h.key, lost_t_, lost_key_)) return false;
    if (!full()) return true;
    int const farthest = slot_from_back(0);
    float const t = word(time, farthest);
    u32 const key = key_at(farthest);
    bool const fits = nearer(h.t, h.key, t, key);
    lost_t_ = fits ? t : h.t, lost_key_ = fits ? key : h.key;
    if (!fits) return false;
    order_ >>= 4;
    give_back(farthest);
    return true;
  }

  __device__ GART_INLINE int free_slot() const { return __ffs(static_cast<int>(free_)) - 1; }

  __device__ GART_INLINE void put(waiting_hit const& h, int slot) {
    free_ &= free_ - 1;
    word(time, slot) = h.t, word(opacity, slot) = h.alpha;
    word(red, slot) = h.shown.x, word(green, slot) = h.shown.y, word(blue, slot) = h.shown.z;
    word(key_bits, slot) = bits_to_float(h.key);
    ++count_;
    int const bits = 4 * hits_behind(h);
    u64 const low = (u64{1} << bits) - 1;
    order_ = (order_ & low) | u64(slot) << bits | (order_ & ~low) << 4;
  }

  // How many hits of the window come after h. From the back, where most belong, four at a time: shared memory is waited
  // for once.
  __device__ GART_INLINE int hits_behind(waiting_hit const& h) const {
    int behind = 0;
    for (u64 rest = order_;; rest >>= 16) {
      int farther = 0;
      bool tied = false;
      GART_UNROLL
      for (int k = 0; k < 4; ++k) {
        float const t = word(time, static_cast<int>(rest) >> (4 * k) & 15);
        farther += t > h.t, tied |= t == h.t;
      }
      if (tied) break;
      behind += farther;
      if (farther < 4) return behind;
    }
    for (;; ++behind) {
      int const other = slot_from_back(behind);
      float const t = word(time, other);
      if (t < h.t || (t == h.t && !before_(h.key, key_at(other)))) return behind;
    }
  }

  __device__ GART_INLINE waiting_hit at(int slot) const {
    return {
        word(time, slot), word(opacity, slot), {word(red, slot), word(green, slot), word(blue, slot)}, key_at(slot)};
  }

  __device__ GART_INLINE void give_back(int slot) { free_ |= 1u << slot, --count_; }

  // Runs. left_: how many each still has, 4 bits a run.
  __device__ GART_INLINE int free_run() const {
    u64 const any = left_ | left_ >> 1 | left_ >> 2 | left_ >> 3;
    return (__ffsll(static_cast<long long>(~any & 0x1111111111111111ull)) - 1) / 4;
  }
  __device__ GART_INLINE pair* spilled_at(int r, int k) const { return spilled_ + 3 * (r * run + k); }
  __device__ GART_INLINE pair* next_spilled(int r) const {
    return spilled_at(r, run - (static_cast<int>(left_ >> (4 * r)) & 15));
  }
  __device__ GART_INLINE pair* next_spilled() const { return next_spilled(next_run_); }
  __device__ GART_INLINE static u32 key_of(pair const* spilled) { return float_to_bits(spilled[0].b); }

  // All but the first of the window, at a run's end.
  __device__ GART_INLINE void spill(int to) {
    int const count = count_ - 1, kept = slot_from_back(count);
    pair* out = spilled_at(to, run);
    float first = infinity;
    u64 rest = order_;
    for (int k = 0; k < count; ++k, rest >>= 4) {
      waiting_hit const h = at(static_cast<int>(rest) & 15);
      out -= 3;
      out[0] = {h.t, bits_to_float(h.key)}, out[1] = {h.alpha, h.shown.x}, out[2] = {h.shown.y, h.shown.z};
      first = h.t;
    }
    order_ = kept, free_ = every_slot & ~(1u << kept), count_ = 1;
    left_ |= u64(count) << (4 * to);
    set_first(to, first);
  }

  __device__ GART_INLINE waiting_hit take_of_run() {
    int const from = next_run_;
    pair const* const out = next_spilled();
    pair const a = out[0], b = out[1], c = out[2];
    left_ -= u64{1} << (4 * from);
    bool const more = (left_ >> (4 * from) & 15) != 0;
    set_first(from, more ? out[3].a : infinity);
    return {a.a, b.a, {b.b, c.a, c.b}, float_to_bits(a.b)};
  }

  // The t of a run's next hit; which run is next.
  __device__ GART_INLINE void set_first(int r, float t) {
    next_t_ = infinity;
    int ties = 0;
    GART_UNROLL
    for (int k = 0; k < runs; ++k) {
      if (k == r) first_t_[k] = t;
      ties += first_t_[k] == next_t_;
      if (first_t_[k] < next_t_) next_t_ = first_t_[k], next_run_ = k, ties = 0;
    }
    if (ties == 0 || next_t_ == infinity) return;
    GART_UNROLL
    for (int k = 1; k < runs; ++k)
      if (k > next_run_ && first_t_[k] == next_t_ && before_(key_of(next_spilled(k)), key_of(next_spilled())))
        next_run_ = k;
  }

  float* own_;     // the lane's words of the window
  pair* spilled_;  // the lane's own, [runs][run][3]: t and key, alpha and what is shown
  KeyOrder before_;
  u64 order_, left_;
  u32 free_;
  int count_;
  float first_t_[runs], next_t_, lost_t_;
  int next_run_;
  u32 lost_key_;
};

}}  // namespace gart::GART_ISA

#endif
