#pragma once
/// \file
/// The pending hits of one ray of a warp (trace/warp_walk.hpp), in the order (t, id). The latest 14 lie in a window in
/// shared memory, each lane in a bank of its own. A register of 4-bit numbers has their slots in order, and behind them
/// the free ones: a hit that is taken leaves its slot where the next free one is expected. A full window is spilled,
/// all but its first hit, as a run, in order, to memory of its own; of each run the next hit's t is in a register. The
/// next hit of all is the window's first or that of a run. So a hit is spilled once at most, and the order of others is
/// never made anew for it.
///
/// Where all runs are taken a hit is lost: what is passed on from then on lies before the nearest hit that was.
/// Memory: 24 bytes for each of 182 hits a lane. Device only.

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

/// Order of hits at one t: places of a pixel's hits have the order of their ids; entries are asked for them.
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
  static constexpr int window = 14;  // `order_` has room for 16
  static constexpr int run = window - 1, runs = 14;
  static constexpr int last = 4;
  static_assert(run < 16 && runs < 16);  // `left_` has 4 bits a run; free_run: some of them are always zero
  static constexpr float infinity = __builtin_huge_valf();
  static constexpr u64 numbers = 0x00dcba9876543210ull;  // what lies past the window's is never taken

  struct alignas(8) pair {
    float a, b;
  };

 public:
  /// What a warp shares.
  struct scratch {
    float words[6 * window][lanes];  ///< of the waiting hits, a bank a lane
  };
  static constexpr std::size_t spill_floats_a_lane = std::size_t{6} * runs * run;  ///< of a lane

  /// spill_memory: of the warp's lanes, on a boundary of 8 bytes.
  __device__ GART_INLINE warp_hit_queue(scratch& s, float* spill_memory, int lane, KeyOrder before)
      : own_(&detail::kept_address<float>(&s.words[0][lane])),
        spilled_(reinterpret_cast<pair*>(spill_memory + spill_floats_a_lane * lane)),
        before_(before) {
    clear();
  }

  /// Empties it.
  __device__ GART_INLINE void clear() {
    order_ = numbers, count_ = 0;
    GART_UNROLL
    for (int k = 0; k < last; ++k) last_t_[k] = -infinity;
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

  /// For a window that is full, and for one that soon will be: lanes that spill do so together, without divergence.
  __device__ GART_INLINE void make_room() {
    if (count_ < window - 3) return;
    int const to = free_run();
    if (to < runs) spill(to);
  }

  /// A hit, where there is room() or must be some: then one may be lost.
  __device__ GART_INLINE void add(waiting_hit const& h) {
    if (lost() | full()) {
      if (!has_place(h)) return;
    }
    put(h);
  }

  /// The next hit of all.
  struct next_hit {
    waiting_hit first;  ///< of the window
    float t;            ///< of the next hit; infinity: there is none
    bool from_run;      ///< whether it is not the window's
  };
  /// Which that is. All words of it are read at once, taken or not: shared memory is waited for once.
  __device__ GART_INLINE next_hit next() const {
    next_hit n;
    n.first = at(slot_from_back(count_ - 1));
    float const t = count_ > 0 ? n.first.t : infinity;
    n.from_run = next_t_ < t;
    if (next_t_ == t && t < infinity) n.from_run = before_(key_of(next_spilled()), n.first.key);
    n.t = n.from_run ? next_t_ : t;
    return n;
  }
  /// Whether it comes before what was lost, and t * cosine < depth.
  __device__ GART_INLINE bool is_due(next_hit const& n, float depth, float cosine) const {
    bool due = n.t * cosine < depth;
    if (due & (n.t >= lost_t_))
      due = nearer(n.t, n.from_run ? key_of(next_spilled()) : n.first.key, lost_t_, lost_key_);
    return due;
  }
  /// Takes it.
  __device__ GART_INLINE waiting_hit take(next_hit const& n) {
    if (n.from_run) return take_of_run();
    --count_;
    return n.first;
  }

 private:
  enum field { time, opacity, red, green, blue, key_bits };

  // Of the hit in a slot of the window.
  __device__ GART_INLINE float& word(field f, int slot) const { return own_[(f * window + slot) * lanes]; }
  __device__ GART_INLINE u32 key_at(int slot) const { return float_to_bits(word(key_bits, slot)); }

  __device__ GART_INLINE bool nearer(float t, u32 key, float other_t, u32 other) const {
    return t != other_t ? t < other_t : before_(key, other);
  }

  // The slot of the window's hit that has k behind it; a free one where there is none.
  __device__ GART_INLINE int slot_from_back(int k) const { return static_cast<int>(order_ >> (4 * (k & 15))) & 15; }
  // The first `count` numbers of `order_`.
  __device__ GART_INLINE static u64 first_numbers(int count) { return (u64{1} << (4 * count)) - 1; }

  // Where some hit was lost or the window is full: whether there is a place for this one, nearer than what was lost or
  // will be for it.
  __device__ GART_INLINE bool has_place(waiting_hit const& h) {
    if (lost() && !nearer(h.t, h.key, lost_t_, lost_key_)) return false;
    if (!full()) return true;
    int const farthest = slot_from_back(0);
    float const t = word(time, farthest);
    u32 const key = key_at(farthest);
    bool const fits = nearer(h.t, h.key, t, key);
    lost_t_ = fits ? t : h.t, lost_key_ = fits ? key : h.key;
    if (!fits) return false;
    order_ = (order_ >> 4 & first_numbers(window - 1)) | u64(farthest) << (4 * (window - 1));
    --count_;
    find_last();
    return true;
  }

  __device__ GART_INLINE void put(waiting_hit const& h) {
    int const slot = slot_from_back(window - 1);
    int const bits = 4 * hits_behind(h);
    word(time, slot) = h.t, word(opacity, slot) = h.alpha;
    word(red, slot) = h.shown.x, word(green, slot) = h.shown.y, word(blue, slot) = h.shown.z;
    word(key_bits, slot) = bits_to_float(h.key);
    ++count_;
    u64 const low = (u64{1} << bits) - 1;
    order_ = (order_ & low) | u64(slot) << bits | (order_ & ~low) << 4;
  }

  // How many hits of the window come after h. Most belong behind all but a few, whose t are in registers; what has been
  // passed on and still stands there comes before.
  __device__ GART_INLINE int hits_behind(waiting_hit const& h) {
    int behind = 0;
    bool tied = false;
    GART_UNROLL
    for (int k = 0; k < last; ++k) {
      behind = h.t < last_t_[k] ? k + 1 : behind, tied |= h.t == last_t_[k];
    }
    float t = h.t;
    GART_UNROLL
    for (int k = 0; k < last; ++k) {
      float const farther = fmaxf(t, last_t_[k]);
      t = fminf(t, last_t_[k]), last_t_[k] = farther;
    }
    if (tied) behind = 0;
    if (tied | (behind == last))
      for (; behind < count_; ++behind) {
        int const other = slot_from_back(behind);
        float const t = word(time, other);
        if (t < h.t || (t == h.t && !before_(h.key, key_at(other)))) break;
      }
    return behind;
  }

  // The same registers for the hits that the window has.
  __device__ GART_INLINE void find_last() {
    GART_UNROLL
    for (int k = 0; k < last; ++k) last_t_[k] = k < count_ ? word(time, slot_from_back(k)) : -infinity;
  }

  __device__ GART_INLINE waiting_hit at(int slot) const {
    return {
        word(time, slot), word(opacity, slot), {word(red, slot), word(green, slot), word(blue, slot)}, key_at(slot)};
  }

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
      int const slot = static_cast<int>(rest) & 15;
      waiting_hit const h = at(slot);
      out -= 3;
      out[0] = {h.t, bits_to_float(h.key)}, out[1] = {h.alpha, h.shown.x}, out[2] = {h.shown.y, h.shown.z};
      first = h.t;
    }
    u64 const spilled = first_numbers(count);
    order_ = (order_ & ~(spilled << 4 | 15)) | (order_ & spilled) << 4 | u64(kept), count_ = 1;
    find_last();
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
  int count_;
  float last_t_[last];  // of the window's farthest hits, the farthest first
  float first_t_[runs], next_t_, lost_t_;
  int next_run_;
  u32 lost_key_;
};

}}  // namespace gart::GART_ISA

#endif
