#pragma once
// The walk of tile lists on a device: a warp takes a block of 8 x 4 pixels of a tile, a lane a ray. The same as
// walk_tiles (trace/tile_tracer.hpp), hit by hit and bit by bit; what differs is that all rays of the warp meet a
// candidate together. So candidates that miss the block are left out by one vote, the others come through shared memory,
// read ahead while the ones before are evaluated, and what a hit shows is computed as it is found, where its Gaussian is
// the same for all lanes; a ray's pending hits lie in shared memory, each lane in a bank of its own, and their order is
// a register of sixteen 4-bit numbers. Hits are passed on when some ray has no room for another: many rays then have
// some to pass on, and do it together.
//
// A ray that has no room even then drops its farthest hit, and goes on with the nearer ones; when the list is at its
// end, the rays that dropped hits walk it again, from the first candidate dropped and strictly after their last hit.
//
// Beside what every ray program offers, one for warps offers
//   order                        the pixels (render/pixels.hpp)
//   row_floats, row_floats_read  what it reads of a Gaussian to shade a hit, and how much of that is to be read (the
//                                rest is zero); rows_from, where the rows of all Gaussians begin
//   shade(state, row)            what a hit shows
//   place_of(state, range)       where it is recorded, if records_hits
//   add(state, t, alpha, shown, place)  composites a hit; false ends the ray

#include <gart/math/ray_gaussian.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/ray_program.hpp>

#if defined(__CUDACC__)

#include <cuda_pipeline.h>

namespace gart {

template <class Response, int Size, class P>
class walk_tile_warps {
 public:
  static constexpr int lanes = 32, block_size = lanes, min_blocks = 12;
  static constexpr int block_width = 8, block_height = 4;
  static_assert(Size % block_width == 0);
  static constexpr u32 blocks_per_tile = Size * Size / lanes;

  tile_grid<Size> grid;
  tile_map_view map;
  lt_range const* ranges;
  traced_scene scene;
  vec3 forward;  // the camera's axis
  P program;

 private:
  static constexpr int window = 16;  // pending hits of a ray
  static constexpr int group = 4;    // candidates read ahead at once
  static constexpr int row_words = (P::row_floats + 3) / 4;
  static constexpr u32 everyone = 0xffffffffu;
  static constexpr u32 nothing = 0xffffffffu;

  struct candidate {
    ray_gaussian gaussian;
    quad row[row_words];
  };

 public:
  struct scratch {
    candidate ahead[2][group];
    // Of the candidates that 32 entries of the list leave.
    lt_range range[lanes];
    u32 id[lanes], entry[lanes];
    float depth[lanes];
    // The pending hits of each lane.
    float t[window][lanes], alpha[window][lanes], red[window][lanes], green[window][lanes], blue[window][lanes];
    u32 entry_of[window][lanes];
    u32 place[P::records_hits ? window : 1][lanes];
  };

  template <class Team>
  __device__ void operator()(Team const& team) const {
    u32 const tile = team.tile() / blocks_per_tile, part = team.tile() % blocks_per_tile;
    pixel_box const area = grid.tile(tile);
    pixel const corner{static_cast<int>(area.x0 + part % (Size / block_width) * block_width),
                       static_cast<int>(area.y0 + part / (Size / block_width) * block_height)};
    if (!program.order.inside(corner)) return;
    rays r(*this, team.scratch(), corner);
    for (u32 first = map.offsets[tile], end = map.offsets[tile + 1]; first < end;) first = r.walk(first, end);
    r.end();
  }

 private:
  class rays {
   public:
    __device__ rays(walk_tile_warps const& k, scratch& s, pixel corner)
        : k_(k), s_(s), lane_(static_cast<int>(threadIdx.x)), corner_(corner) {
      pixel const at{corner.x + lane_ % block_width, corner.y + lane_ / block_width};
      index_ = k.program.order.index(at);
      alive_ = k.program.order.inside(at);
      state_ = k.program.begin(index_);
      ray_ = k.program.ray_of(index_, state_);
      vec3 const& d = ray_.direction;
      // z = t * cosine; rounded up, so that what is said to lie nearer than a depth does.
      cosine_ = (d.x * k.forward.x + d.y * k.forward.y + d.z * k.forward.z) * 1.000002f;
      last_t_ = k.scene.near;
      for (int w = lane_; w < 2 * group * row_words; w += lanes)
        s.ahead[w / (group * row_words)][w / row_words % group].row[w % row_words] = {};
    }

    // Once along the list, from `first`. Where to begin again for the hits that were dropped: `end`, where none were.
    __device__ u32 walk(u32 first, u32 end) {
      limit_t_ = infinity, limit_entry_ = nothing, resume_ = end;
      u32 id = 0;
      float depth = 0;
      auto const look_ahead = [&](u32 entry) {
        if (entry < end) id = k_.map.primitives[entry], depth = k_.map.depth(entry);
      };
      look_ahead(first + lane_);
      for (u32 from = first; from < end; from += lanes) {
        int const count = leave_out(from + lane_ < end, from + lane_, id, depth);
        look_ahead(from + lanes + lane_);
        if (!meet(count)) return end;
      }
      pass_on(infinity);
      alive_ = alive_ && resume_ < end;
      return __reduce_min_sync(everyone, alive_ ? resume_ : end);
    }

    __device__ void end() {
      if (last_entry_ != nothing) k_.program.set_last(state_, last_t_, k_.map.primitives[last_entry_]);
      if (k_.program.active(index_)) k_.program.end(index_, state_);
    }

   private:
    // Keeps, of 32 entries, those whose boxes overlap the block; how many.
    __device__ int leave_out(bool exists, u32 entry, u32 id, float depth) {
      lt_range range;
      if (exists) range = k_.ranges[id];
      pixel_box const& b = range.box;
      bool const wanted = exists && b.x0 < corner_.x + block_width && b.x1 > corner_.x &&
                          b.y0 < corner_.y + block_height && b.y1 > corner_.y;
      u32 const all = __ballot_sync(everyone, wanted);
      if (wanted) {
        int const to = __popc(all & ((1u << lane_) - 1));
        s_.id[to] = id, s_.entry[to] = entry, s_.depth[to] = depth;
        if constexpr (P::records_hits) s_.range[to] = range;
      }
      __syncwarp();
      return __popc(all);
    }

    // All candidates that were left, a group read while the one before is evaluated. False when all rays have ended.
    __device__ bool meet(int count) {
      bool more = true;
      read(0, 0, count);
      for (int first = 0, side = 0; first < count && more; first += group, side ^= 1) {
        read(side ^ 1, first + group, count);
        __pipeline_wait_prior(1);
        __syncwarp();
        for (int c = 0; c < group && first + c < count && more; ++c) more = evaluate(s_.ahead[side][c], first + c);
        __syncwarp();
      }
      __pipeline_wait_prior(0);
      __syncwarp();
      return more;
    }

    __device__ void read(int side, int first, int count) {
      constexpr int record_words = sizeof(ray_gaussian) / sizeof(quad);
      if (int const c = lane_ / record_words; c < group && first + c < count) {
        int const w = lane_ % record_words;
        __pipeline_memcpy_async(reinterpret_cast<quad*>(&s_.ahead[side][c].gaussian) + w,
                                reinterpret_cast<quad const*>(k_.scene.gaussians + s_.id[first + c]) + w, sizeof(quad));
      }
      constexpr int step = P::row_floats % 4 == 0 ? 4 : 1, steps = P::row_floats / step;
      for (int w = lane_; w < group * steps; w += lanes) {
        int const c = w / steps, at = w % steps * step;
        if (first + c >= count || at >= k_.program.row_floats_read()) continue;
        __pipeline_memcpy_async(
            reinterpret_cast<float*>(s_.ahead[side][c].row) + at,
            k_.program.rows_from() + static_cast<std::size_t>(P::row_floats) * s_.id[first + c] + at,
            step * sizeof(float));
      }
      __pipeline_commit();
    }

    // One candidate, all rays. False when all have ended.
    __device__ GART_INLINE bool evaluate(candidate const& c, int number) {
      u32 const entry = s_.entry[number];
      response const r = gart::evaluate<Response>(c.gaussian, ray_);
      bool hit = alive_ && is_hit(c.gaussian, r, k_.scene.near) && nearer(last_t_, last_entry_, r.t, entry) &&
                 nearer(r.t, entry, limit_t_, limit_entry_);
      if (!__any_sync(everyone, hit)) return true;
      if (__any_sync(everyone, hit && count_ == window)) {
        pass_on(s_.depth[number]);
        hit = hit && alive_;
        if (!__any_sync(everyone, alive_)) return false;
      }
      if (hit && (count_ < window || make_room(r.t, entry))) {
        int const slot = __ffs(static_cast<int>(free_)) - 1;
        free_ &= free_ - 1;
        s_.t[slot][lane_] = r.t;
        s_.entry_of[slot][lane_] = entry;
        s_.alpha[slot][lane_] = hit_alpha<Response>(c.gaussian, r);
        vec3 const shown = k_.program.shade(state_, reinterpret_cast<float const*>(c.row));
        s_.red[slot][lane_] = shown.x, s_.green[slot][lane_] = shown.y, s_.blue[slot][lane_] = shown.z;
        if constexpr (P::records_hits) s_.place[slot][lane_] = k_.program.place_of(state_, s_.range[number]);
        insert(slot, r.t, entry);
      }
      return true;
    }

    // The order of hits, (t, id); entries stand for ids, which are asked for only where distances are equal.
    __device__ GART_INLINE bool nearer(float t, u32 entry, float other_t, u32 other) const {
      if (t != other_t) return t < other_t;
      return entry != nothing && other != nothing && k_.map.primitives[entry] < k_.map.primitives[other];
    }

    // From the back, where most belong.
    __device__ GART_INLINE void insert(int slot, float t, u32 entry) {
      int k = count_++;
      for (; k > 0; --k) {
        int const before = static_cast<int>(order_ >> (4 * (k - 1))) & 15;
        if (!nearer(t, entry, s_.t[before][lane_], s_.entry_of[before][lane_])) break;
      }
      u64 const low = (u64{1} << (4 * k)) - 1;
      order_ = (order_ & low) | u64(slot) << (4 * k) | (order_ & ~low) << 4;
    }

    // The window is full: the farthest hit is dropped. False where that is the new one.
    __device__ GART_INLINE bool make_room(float t, u32 entry) {
      int const farthest = static_cast<int>(order_ >> 60);
      float const farthest_t = s_.t[farthest][lane_];
      u32 const farthest_entry = s_.entry_of[farthest][lane_];
      bool const fits = nearer(t, entry, farthest_t, farthest_entry);
      limit_t_ = fits ? farthest_t : t;
      limit_entry_ = fits ? farthest_entry : entry;
      resume_ = limit_entry_ < resume_ ? limit_entry_ : resume_;
      if (fits) {
        --count_;
        free_ |= 1u << farthest;
        order_ &= (u64{1} << 60) - 1;
      }
      return fits;
    }

    // Hits nearer than `depth`, which nothing that is left of the list comes before.
    __device__ GART_INLINE void pass_on(float depth) {
      while (alive_ && count_ > 0) {
        int const slot = static_cast<int>(order_) & 15;
        float const t = s_.t[slot][lane_];
        if (!(t * cosine_ < depth)) break;
        order_ >>= 4, --count_;
        free_ |= 1u << slot;
        last_t_ = t, last_entry_ = s_.entry_of[slot][lane_];
        u32 place = 0;
        if constexpr (P::records_hits) place = s_.place[slot][lane_];
        alive_ = k_.program.add(state_, t, s_.alpha[slot][lane_],
                                {s_.red[slot][lane_], s_.green[slot][lane_], s_.blue[slot][lane_]}, place);
      }
    }

    static constexpr float infinity = __builtin_huge_valf();

    walk_tile_warps const& k_;
    scratch& s_;
    int lane_;
    pixel corner_;
    index_t index_;
    primary_ray ray_;
    typename P::state state_;
    float cosine_;
    bool alive_;
    float last_t_;  // the last hit passed on: at first (near, none), t > near
    u32 last_entry_ = nothing;
    float limit_t_ = infinity;  // the nearest hit dropped
    u32 limit_entry_ = nothing, resume_ = nothing;
    u64 order_ = 0;  // slots of the pending hits, nearest first, 4 bits each
    u32 free_ = (1u << window) - 1;
    int count_ = 0;
  };
};

}  // namespace gart

#endif
