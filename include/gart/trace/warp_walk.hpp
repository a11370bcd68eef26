#pragma once
/// \file
/// The walk of tile lists on a device. A warp takes a block of 8 x 4 pixels of a tile, a lane a ray. It does the same
/// as walk_tiles (trace/tile_tracer.hpp), hit by hit and bit by bit. All rays of the warp meet a candidate together. So
/// one vote leaves out candidates that miss the block. The others come through shared memory, read ahead while earlier
/// ones are evaluated. Of each group of four a ray then takes its own hits, one after the other. It computes what they
/// show. So few lanes idle where a candidate is a hit of some rays alone. A ray's pending hits are in a queue
/// (trace/warp_hit_queue.hpp). Hits are passed on when the window of some ray's queue is full. Many rays then have some
/// to pass on, and do it together. Where a queue loses a hit, the ray passes on the hits before it. Then it walks the
/// list again, strictly after its last hit. The queues take 4.7 KB of device memory for each ray that the device holds
/// at a time: 298 MB on 132 multiprocessors.

#include <gart/camera/ray_depth.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/tracer.hpp>
#include <gart/trace/warp_hit_queue.hpp>
#include <gart/trace/warp_program.hpp>

#if defined(__CUDACC__)

#include <cuda_pipeline.h>

namespace gart { inline namespace GART_ISA {

/// The tile kernel of the walk.
template <class Response, int Size, warp_program P>
class walk_tile_warps {
  static constexpr int lanes = 32, warps = 3;
  static constexpr int block_width = 8, block_height = 4;
  static constexpr int tile_blocks = Size * Size / lanes;
  static_assert(Size % block_width == 0);

 public:
  static constexpr int block_size = warps * lanes,  ///< lanes of a team
      min_blocks = 5;  ///< teams a multiprocessor holds: as many warps as its shared memory has room for
  static constexpr u32 tile_parts = tile_blocks;                                  ///< parts of a tile, a warp each
  using key_order = std::conditional_t<P::uses_slots, place_order, entry_order>;  ///< the order of hits at one t
  using queue = warp_hit_queue<key_order>;                                        ///< of a lane's ray
  static constexpr std::size_t spill_floats = queue::spill_floats_a_lane * block_size;  ///< of a team's rays

  tile_grid<Size> grid;  ///< of the view
  tile_map_view map;     ///< the tiles' lists
  /// [N]: boxes, and where their slots begin.
  footprint_slots const* ranges;
  traced_scene scene;        ///< what is traced
  ray_depth depth;           ///< that lists are sorted by
  P program;                 ///< whose rays they are
  u32* next = nullptr;       ///< part of a tile that is to be taken next, zero at first
  float* spilled = nullptr;  ///< [teams][spill_floats]

 private:
  static constexpr int group = 4;  // candidates staged at once
  // 16-byte words of a candidate: its Gaussian, then its row, which may not be a whole number of them.
  static constexpr int gaussian_words = sizeof(ray_gaussian) / sizeof(quad), row_words = (P::row_floats + 3) / 4;
  static constexpr bool whole_rows = P::row_floats % 4 == 0;
  static constexpr u32 full_warp = 0xffffffffu;
  static constexpr u32 no_key = 0xffffffffu;

  // Of an odd number of words, so that lanes that read different candidates read different banks.
  struct candidate {
    ray_gaussian gaussian;
    quad row[row_words + (gaussian_words + row_words + 1) % 2];
  };

  struct warp_scratch {
    candidate staged[2][group];
    // Of the candidates that 32 entries of the list leave.
    typename P::cell cell[P::uses_slots ? lanes : 1];
    u32 id[lanes], entry[lanes];
    float depth[lanes];
    typename queue::scratch pending;
  };

 public:
  /// What a team shares.
  struct scratch {
    warp_scratch warp[warps];  ///< of each
  };

  /// As many teams as the device holds. Their warps take parts of tiles, those of the longest lists first, until there
  /// are no more.
  template <class Team>
  __device__ void operator()(Team const& team) const {
    int const warp = static_cast<int>(threadIdx.x) / lanes;
    warp_scratch& s = team.scratch().warp[warp];
    float* const memory = spilled + team.tile() * spill_floats + warp * (spill_floats / warps);
    u32 const parts = grid.count() * tile_parts;
    while (true) {
      u32 part = 0;
      if (threadIdx.x % lanes == 0) part = atomicAdd(next, 1u);
      part = __shfl_sync(full_warp, part, 0);
      if (part >= parts) return;
      trace(s, memory, map.longest_first[part / tile_parts], part % tile_parts);
    }
  }

 private:
  __device__ GART_INLINE void trace(warp_scratch& s, float* memory, u32 tile, u32 part) const {
    pixel_box const area = grid.tile(tile);
    pixel const corner{static_cast<int>(area.x0 + part % (Size / block_width) * block_width),
                       static_cast<int>(area.y0 + part / (Size / block_width) * block_height)};
    if (!program.order.inside(corner)) return;
    rays r(*this, s, memory, area, corner);
    bool again = true;
    while (again) again = r.walk(map.offsets[tile], map.offsets[tile + 1]);
    r.end();
  }

  class rays {
   public:
    __device__ GART_INLINE rays(walk_tile_warps const& k, warp_scratch& s, float* memory, pixel_box const& area,
                                pixel corner)
        : k_(k),
          s_(s),
          lane_(static_cast<int>(threadIdx.x) % lanes),
          area_(area),
          corner_(corner),
          before_(order_of(k)),
          pending_(s.pending, memory, lane_, before_) {
      at_ = {corner.x + lane_ % block_width, corner.y + lane_ / block_width};
      index_ = k.program.order.index(at_);
      alive_ = k.program.order.inside(at_);
      // A lane outside of the image has the corner's ray, which is in the tables that rays are read from.
      index_t const seen = alive_ ? index_ : k.program.order.index(corner);
      state_ = k.program.begin(seen);
      ray_ = k.program.ray_of(seen, state_);
      depth_of_t_ = k.depth.per_distance(ray_.direction);
      last_t_ = k.scene.near;
      for (int w = lane_; w < 2 * group * row_words; w += lanes)
        s.staged[w / (group * row_words)][w / row_words % group].row[w % row_words] = {};
    }

    // Once along the list. Whether to walk it again, for hits that were lost.
    __device__ GART_INLINE bool walk(u32 first, u32 end) {
      pending_.clear();
      u32 id = 0;
      float depth = 0;
      auto const look_ahead = [&](u32 entry) {
        if (entry < end) id = k_.map.primitives[entry], depth = k_.map.depth(entry);
      };
      look_ahead(first + lane_);
      for (u32 from = first; from < end; from += lanes) {
        int const count = leave_out(from + lane_ < end, from + lane_, id, depth);
        look_ahead(from + lanes + lane_);
        if (!meet(count)) break;
      }
      pass_on(infinity);
      alive_ = alive_ && pending_.lost();
      return __any_sync(full_warp, alive_);
    }

    __device__ GART_INLINE void end() {
      if (k_.program.active(index_)) k_.program.end(index_, state_);
    }

   private:
    // Keeps, of 32 entries, those whose boxes overlap the block; how many.
    __device__ GART_INLINE int leave_out(bool exists, u32 entry, u32 id, float depth) {
      footprint_slots range;
      if (exists) range = k_.ranges[id];
      pixel_box const& b = range.box;
      int const x = corner_.x + static_cast<int>(range.columns_past(area_.x1));
      bool const wanted =
          exists && b.x0 < x + block_width && b.x1 > x && b.y0 < corner_.y + block_height && b.y1 > corner_.y;
      u32 const all = __ballot_sync(full_warp, wanted);
      if (wanted) {
        int const to = __popc(all & ((1u << lane_) - 1));
        s_.id[to] = id, s_.entry[to] = entry, s_.depth[to] = depth;
        if constexpr (P::uses_slots) s_.cell[to] = typename P::cell(range, area_);
      }
      __syncwarp();
      return __popc(all);
    }

    // All candidates that were left, a group read while the one before is evaluated. False when no ray needs more.
    __device__ GART_INLINE bool meet(int count) {
      bool more = true;
      read(0, 0, count);
      for (int first = 0, side = 0; first < count && more; first += group, side ^= 1) {
        read(side ^ 1, first + group, count);
        __pipeline_wait_prior(1);
        __syncwarp();
        more = evaluate(s_.staged[side], first, count);
        __syncwarp();
      }
      __pipeline_wait_prior(0);
      __syncwarp();
      return more;
    }

    // Copies the first floats of a word to shared memory, and zero for the others. The active bands may end within a
    // word. Unlike for __pipeline_memcpy_async, the compiler need not know the number of zeros.
    __device__ GART_INLINE static void copy_part(quad* to, quad const* from, int floats) {
      asm volatile(
          "cp.async.cg.shared.global [%0], [%1], 16, %2;" ::"r"(static_cast<u32>(__cvta_generic_to_shared(to))),
          "l"(__cvta_generic_to_global(from)), "r"(4 * floats)
          : "memory");
    }

    // Eight lanes a candidate.
    __device__ GART_INLINE void read(int side, int first, int count) {
      constexpr int readers = lanes / group;
      int const reader = lane_ % readers, number = first + lane_ / readers;
      if (number < count) {
        u32 const id = s_.id[number];
        candidate& to = s_.staged[side][lane_ / readers];
        quad const* const gaussian = reinterpret_cast<quad const*>(k_.scene.gaussians + id);
        float const* const row = k_.program.rows_from() + static_cast<std::size_t>(P::row_floats) * id;
        if constexpr (whole_rows) {
          GART_UNROLL
          for (int w = 0; w < gaussian_words + row_words; w += readers) {
            int const word = w + reader, in_row = word - gaussian_words;
            bool const of_gaussian = in_row < 0;
            int const left = k_.program.row_floats_read() - 4 * in_row;
            quad const* const from = of_gaussian ? gaussian + word : reinterpret_cast<quad const*>(row) + in_row;
            if (of_gaussian || (in_row < row_words && left >= 4))
              __pipeline_memcpy_async(reinterpret_cast<quad*>(&to) + word, from, sizeof(quad));
            else if (in_row < row_words && left > 0)
              copy_part(reinterpret_cast<quad*>(&to) + word, from, left);
          }
        } else {
          if (reader < gaussian_words)
            __pipeline_memcpy_async(reinterpret_cast<quad*>(&to) + reader, gaussian + reader, sizeof(quad));
          for (int w = reader; w < k_.program.row_floats_read(); w += readers)
            __pipeline_memcpy_async(reinterpret_cast<float*>(to.row) + w, row + w, sizeof(float));
        }
      }
      __pipeline_commit();
    }

    // The candidates of a group, all rays. False when no ray needs more: all have ended, or have lost a nearer hit.
    __device__ GART_INLINE bool evaluate(candidate const (&from)[group], int first, int count) {
      float t[group], d2[group];
      u32 found = 0, tied = 0;
      ray_peak two[2];
      GART_UNROLL
      for (int c = 0; c < group; ++c) {
        if (c % 2 == 0) evaluate_all(two, [&](int k) { return approach_to(from[c + k].gaussian, ray_); });
        ray_peak const& r = two[c % 2];
        t[c] = r.t, d2[c] = r.d2;
        bool const is_new = is_hit(from[c].gaussian, r, last_t_), exists = first + c < count;
        found |= (exists & is_new ? 1u : 0u) << c;
        tied |= (exists & (r.t == last_t_) ? 1u : 0u) << c;
      }
      if (tied && last_key_ != no_key) {
        GART_UNROLL
        for (int c = 0; c < group; ++c)
          if ((tied >> c & 1) && follows_last(from[c].gaussian, t[c], d2[c], first + c)) found |= 1u << c;
      }
      if (!alive_) found = 0;
      if (__any_sync(full_warp, __popc(found) > pending_.room())) return add_crowded(from, t, d2, found, first);
      GART_NO_UNROLL
      for (; __any_sync(full_warp, found); found &= found - 1)
        if (found) add(from, t, d2, __ffs(static_cast<int>(found)) - 1, first);
      return true;
    }

    // The same where a ray may have no room. Hits before the first remaining one are passed on, to make some.
    __device__ GART_INLINE bool add_crowded(candidate const (&from)[group], float const (&t)[group],
                                            float const (&d2)[group], u32 found, int first) {
      bool tried = false;
      GART_NO_UNROLL
      while (u32 const left = __reduce_or_sync(full_warp, found)) {
        if (__any_sync(full_warp, found && pending_.full())) {
          if (!tried) {
            tried = true;
            float const depth = s_.depth[first + __ffs(static_cast<int>(left)) - 1];
            pass_on(depth);
            if (!__any_sync(full_warp, alive_ && !(pending_.lost_t() * depth_of_t_ <= depth))) return false;
            if (!alive_) found = 0;
          }
          if (__any_sync(full_warp, found && pending_.full())) pending_.make_room();
        }
        if (found) add(from, t, d2, __ffs(static_cast<int>(found)) - 1, first);
        found &= found - 1;
      }
      return true;
    }

    // Candidate c, a hit of this ray.
    __device__ GART_INLINE void add(candidate const (&from)[group], float const (&t)[group], float const (&d2)[group],
                                    int c, int first) {
      pending_.add({pick(t, c), hit_alpha<Response>(from[c].gaussian, pick(d2, c)),
                    k_.program.shade(state_, reinterpret_cast<float const*>(from[c].row)), key_of(first + c)});
    }

    // v[c] of an array in registers.
    __device__ GART_INLINE static float pick(float const (&v)[group], int c) {
      float out = v[0];
      GART_UNROLL
      for (int k = 1; k < group; ++k) out = c == k ? v[k] : out;
      return out;
    }

    // A hit at the distance of the last one passed on.
    __device__ bool follows_last(ray_gaussian const& g, float t, float d2, int number) const {
      return d2 <= g.cutoff && t > k_.scene.near && before_(last_key_, key_of(number));
    }

    __device__ GART_INLINE u32 key_of(int number) const {
      if constexpr (P::uses_slots)
        return P::cell::read(s_.cell[number]).place_of(at_.x, at_.y);
      else
        return s_.entry[number];
    }

    // Hits nearer than `depth`, which nothing that is left of the list comes before.
    __device__ GART_INLINE void pass_on(float depth) {
      if (!alive_) return;
      pending_.pass_on(depth, depth_of_t_, [this](waiting_hit const& h) {
        last_t_ = h.t, last_key_ = h.key;
        return alive_ = k_.program.add(state_, h.t, h.alpha, h.shown, P::uses_slots ? h.key : 0);
      });
    }

    __device__ GART_INLINE static key_order order_of(walk_tile_warps const& k) {
      if constexpr (P::uses_slots)
        return {};
      else
        return {k.map.primitives.data()};
    }

    static constexpr float infinity = __builtin_huge_valf();

    walk_tile_warps const& k_;
    warp_scratch& s_;
    int lane_;
    pixel_box area_;
    pixel corner_, at_;
    index_t index_;
    primary_ray ray_;
    typename P::state state_;
    float depth_of_t_;
    bool alive_;
    float last_t_;  // the last hit passed on: at first (near, none), t > near
    u32 last_key_ = no_key;
    key_order before_;
    queue pending_;
  };
};

}}  // namespace gart::GART_ISA

#endif
