#pragma once
// The walk of tile lists on a device: a warp takes a block of 8 x 4 pixels of a tile, a lane a ray. The same as
// walk_tiles (trace/tile_tracer.hpp), hit by hit and bit by bit; what differs is that all rays of the warp meet a
// candidate together. So candidates that miss the block are left out by one vote, the others come through shared
// memory, read ahead while the ones before are evaluated, and what a hit shows is computed as it is found, where its
// Gaussian is the same for all lanes; a ray's pending hits lie in shared memory, each lane in a bank of its own, and
// their order is a register of sixteen 4-bit numbers. Hits are passed on when some ray has no room for another: many
// rays then have some to pass on, and do it together.
//
// What a ray has no room for even then it puts aside, in memory of its own: its farthest hits, in no order, of which
// the nearest fill the window again when it runs empty. Where even that memory is full a hit is lost: the ray then
// passes on what lies before it, and walks the list again, strictly after its last hit. This memory is 24 bytes for
// each of 112 hits, for as many rays as the device holds at a time: 159 MB on 132 multiprocessors.
//
// Beside what every ray program offers, one for warps offers
//   order                        the pixels (render/pixels.hpp)
//   row_floats, row_floats_read  what it reads of a Gaussian to shade a hit, and how much of that is to be read (the
//                                rest is zero); rows_from, where the rows of all Gaussians begin
//   shade(state, row)            what a hit shows
//   records_hits                 whether hits have places in the LT buffer (tiles/layout.hpp)
//   add(state, t, alpha, shown, place)  composites a hit; false ends the ray

#include <gart/math/ray_gaussian.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/ray_program.hpp>

#if defined(__CUDACC__)

#include <cuda_pipeline.h>

#include <utility>

namespace gart {

template <class Response, int Size, class P>
class walk_tile_warps {
  using pixel = decltype(std::declval<P const&>().at(index_t{}));
  static constexpr int lanes = 32, warps = 2;
  static constexpr int block_width = 8, block_height = 4;
  static constexpr int tile_blocks = Size * Size / lanes;
  static_assert(Size % block_width == 0);

 public:
  static constexpr int block_size = warps * lanes, min_blocks = 7;
  static constexpr u32 tile_parts = tile_blocks;
  static constexpr int aside = 112;  // hits a ray can put aside
  static constexpr std::size_t aside_floats = std::size_t{6} * aside * block_size;  // of a team's rays

  tile_grid<Size> grid;
  tile_map_view map;
  lt_range const* ranges;
  traced_scene scene;
  vec3 forward;  // the camera's axis
  P program;
  u32* next = nullptr;         // part of a tile that is to be taken next, zero at first
  float* put_aside = nullptr;  // [teams][aside_floats]

 private:
  static constexpr int window = 16;  // pending hits of a ray: as many as `order_` has room for
  static constexpr int group = 4;    // candidates read ahead at once
  // 16-byte words of a candidate: its record, then its row, which may not be a whole number of them.
  static constexpr int record_words = sizeof(ray_gaussian) / sizeof(quad), row_words = (P::row_floats + 3) / 4;
  static constexpr bool whole_rows = P::row_floats % 4 == 0;
  static constexpr u32 everyone = 0xffffffffu;
  static constexpr u32 nothing = 0xffffffffu;

  struct candidate {
    ray_gaussian gaussian;
    quad row[row_words];
  };

  struct warp_scratch {
    candidate ahead[2][group];
    // Of the candidates that 32 entries of the list leave.
    slot_cell cell[P::records_hits ? lanes : 1];
    u32 id[lanes], entry[lanes];
    float depth[lanes];
    // The pending hits of each lane. Key: a hit's place where hits are recorded, else its Gaussian's entry in the list.
    float t[window][lanes], alpha[window][lanes], red[window][lanes], green[window][lanes], blue[window][lanes];
    u32 key[window][lanes];
  };

  struct pending {
    float t, alpha;
    vec3 shown;
    u32 key;
  };

 public:
  struct scratch {
    warp_scratch warp[warps];
  };

  // As many teams as the device holds: their warps take parts of tiles, those of the longest lists first, until there
  // are no more.
  template <class Team>
  __device__ void operator()(Team const& team) const {
    int const warp = static_cast<int>(threadIdx.x) / lanes;
    warp_scratch& s = team.scratch().warp[warp];
    float* const memory = put_aside + team.tile() * aside_floats + warp * (aside_floats / warps);
    u32 const parts = grid.count() * tile_parts;
    while (true) {
      u32 part = 0;
      if (threadIdx.x % lanes == 0) part = atomicAdd(next, 1u);
      part = __shfl_sync(everyone, part, 0);
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
        : k_(k), s_(s), lane_(static_cast<int>(threadIdx.x) % lanes), area_(area), corner_(corner) {
      aside_ = memory + lane_;
      at_ = {corner.x + lane_ % block_width, corner.y + lane_ / block_width};
      index_ = k.program.order.index(at_);
      alive_ = k.program.order.inside(at_);
      state_ = k.program.begin(index_);
      ray_ = k.program.ray_of(index_, state_);
      vec3 const& d = ray_.direction;
      // z = t * cosine; rounded up, so that what is said to lie nearer than a depth does.
      cosine_ = (d.x * k.forward.x + d.y * k.forward.y + d.z * k.forward.z) * 1.000002f;
      last_t_ = k.scene.near;
      for (int w = lane_; w < 2 * group * row_words; w += lanes)
        s.ahead[w / (group * row_words)][w / row_words % group].row[w % row_words] = {};
    }

    // Once along the list. Whether to walk it again, for hits that were lost.
    __device__ GART_INLINE bool walk(u32 first, u32 end) {
      limit_t_ = lost_t_ = infinity, limit_key_ = lost_key_ = nothing;
      order_ = 0, free_ = (1u << window) - 1, count_ = aside_count_ = 0;
      u32 id = 0;
      float depth = 0;
      auto const look_ahead = [&](u32 entry) {
        if (entry < end) id = k_.map.primitives[entry], depth = k_.map.depth(entry);
      };
      look_ahead(first + lane_);
      for (u32 from = first; from < end; from += lanes) {
        int const count = leave_out(from + lane_ < end, from + lane_, id, depth);
        look_ahead(from + lanes + lane_);
        if (!meet(count)) return false;
      }
      pass_on(infinity);
      alive_ = alive_ && lost_t_ < infinity;
      return __any_sync(everyone, alive_);
    }

    __device__ GART_INLINE void end() {
      if (k_.program.active(index_)) k_.program.end(index_, state_);
    }

   private:
    // Keeps, of 32 entries, those whose boxes overlap the block; how many.
    __device__ GART_INLINE int leave_out(bool exists, u32 entry, u32 id, float depth) {
      lt_range range;
      if (exists) range = k_.ranges[id];
      pixel_box const& b = range.box;
      bool const wanted = exists && b.x0 < corner_.x + block_width && b.x1 > corner_.x &&
                          b.y0 < corner_.y + block_height && b.y1 > corner_.y;
      u32 const all = __ballot_sync(everyone, wanted);
      if (wanted) {
        int const to = __popc(all & ((1u << lane_) - 1));
        s_.id[to] = id, s_.entry[to] = entry, s_.depth[to] = depth;
        if constexpr (P::records_hits) s_.cell[to] = slot_cell(range, area_);
      }
      __syncwarp();
      return __popc(all);
    }

    // All candidates that were left, a group read while the one before is evaluated. False when all rays have ended.
    __device__ GART_INLINE bool meet(int count) {
      bool more = true;
      read(0, 0, count);
      for (int first = 0, side = 0; first < count && more; first += group, side ^= 1) {
        read(side ^ 1, first + group, count);
        __pipeline_wait_prior(1);
        __syncwarp();
        more = evaluate(s_.ahead[side], first, count);
        __syncwarp();
      }
      __pipeline_wait_prior(0);
      __syncwarp();
      return more;
    }

    // Eight lanes a candidate.
    __device__ GART_INLINE void read(int side, int first, int count) {
      constexpr int readers = lanes / group;
      int const reader = lane_ % readers, number = first + lane_ / readers;
      if (number < count) {
        u32 const id = s_.id[number];
        candidate& to = s_.ahead[side][lane_ / readers];
        quad const* const record = reinterpret_cast<quad const*>(k_.scene.gaussians + id);
        float const* const row = k_.program.rows_from() + static_cast<std::size_t>(P::row_floats) * id;
        if constexpr (whole_rows) {
          GART_UNROLL
          for (int w = 0; w < record_words + row_words; w += readers) {
            int const word = w + reader, in_row = word - record_words;
            bool const is_record = in_row < 0;
            if (is_record || (in_row < row_words && 4 * in_row < k_.program.row_floats_read()))
              __pipeline_memcpy_async(reinterpret_cast<quad*>(&to) + word,
                                      is_record ? record + word : reinterpret_cast<quad const*>(row) + in_row,
                                      sizeof(quad));
          }
        } else {
          if (reader < record_words)
            __pipeline_memcpy_async(reinterpret_cast<quad*>(&to) + reader, record + reader, sizeof(quad));
          for (int w = reader; w < k_.program.row_floats_read(); w += readers)
            __pipeline_memcpy_async(reinterpret_cast<float*>(to.row) + w, row + w, sizeof(float));
        }
      }
      __pipeline_commit();
    }

    // The candidates of a group, all rays. False when all have ended.
    __device__ GART_INLINE bool evaluate(candidate const (&from)[group], int first, int count) {
      float t[group], d2[group];
      u32 found = 0;
      GART_UNROLL
      for (int c = 0; c < group; ++c) {  // one beside the other: the arithmetic of each waits for itself
        response const r = gart::evaluate<Response>(from[c].gaussian, ray_);
        t[c] = r.t, d2[c] = r.d2;
        bool const exists = first + c < count;
        if (exists && is_hit(from[c].gaussian, r, last_t_)) found |= 1u << c;
        if (exists && r.t == last_t_ && follows_last(from[c].gaussian, r, first + c)) found |= 1u << c;
      }
      bool tried = false;
      GART_NO_UNROLL
      for (int c = 0; c < group; ++c) {
        bool const hit = alive_ && (found >> c & 1);
        if (!__any_sync(everyone, hit)) continue;
        if (!tried && __any_sync(everyone, hit && count_ == window)) {
          tried = true;
          pass_on(s_.depth[first + c]);
          if (!__any_sync(everyone, alive_)) return false;
        }
        if (hit && alive_) take(from[c], pick(t, c), pick(d2, c), first + c);
      }
      return true;
    }

    // v[c] of an array in registers.
    __device__ GART_INLINE static float pick(float const (&v)[group], int c) {
      float out = v[0];
      GART_UNROLL
      for (int k = 1; k < group; ++k) out = c == k ? v[k] : out;
      return out;
    }

    // A hit at the distance of the last one passed on.
    __device__ bool follows_last(ray_gaussian const& g, response const& r, int number) const {
      return r.d2 <= g.cutoff && r.t > k_.scene.near && last_key_ != nothing &&
             nearer(last_t_, last_key_, r.t, key_of(number));
    }

    __device__ GART_INLINE u32 key_of(int number) const {
      if constexpr (P::records_hits)
        return s_.cell[number].place_of(at_.x, at_.y);
      else
        return s_.entry[number];
    }

    // The order of hits, (t, id). The places of a pixel's hits have the order of their ids; entries are asked for them.
    __device__ GART_INLINE bool nearer(float t, u32 key, float other_t, u32 other) const {
      if (t != other_t) return t < other_t;
      if constexpr (P::records_hits)
        return key < other;
      else
        return k_.map.primitives[key] < k_.map.primitives[other];
    }

    // A hit that one ray, or some, have found.
    __device__ GART_INLINE void take(candidate const& c, float t, float d2, int number) {
      pending const h{t, hit_alpha<Response>(c.gaussian, d2),
                      k_.program.shade(state_, reinterpret_cast<float const*>(c.row)), key_of(number)};
      if (t >= limit_t_ && !nearer(t, h.key, limit_t_, limit_key_)) {
        put_aside(h);
        return;
      }
      if (count_ == window) {
        pending const farthest = take_farthest();
        if (!nearer(t, h.key, farthest.t, farthest.key)) {
          put(farthest);
          limit_t_ = t, limit_key_ = h.key;
          put_aside(h);
          return;
        }
        limit_t_ = farthest.t, limit_key_ = farthest.key;
        put_aside(farthest);
      }
      put(h);
    }

    __device__ GART_INLINE void put(pending const& h) {
      int const slot = __ffs(static_cast<int>(free_)) - 1;
      free_ &= free_ - 1;
      s_.t[slot][lane_] = h.t, s_.alpha[slot][lane_] = h.alpha;
      s_.red[slot][lane_] = h.shown.x, s_.green[slot][lane_] = h.shown.y, s_.blue[slot][lane_] = h.shown.z;
      s_.key[slot][lane_] = h.key;
      int bits = 4 * count_++;
      for (; bits > 0; bits -= 4) {  // from the back, where most belong
        int const before = slot_of(bits / 4 - 1);
        if (!nearer(h.t, h.key, s_.t[before][lane_], s_.key[before][lane_])) break;
      }
      u64 const low = (u64{1} << bits) - 1;
      order_ = (order_ & low) | u64(slot) << bits | (order_ & ~low) << 4;
    }

    __device__ GART_INLINE pending take_slot(int slot) {
      --count_;
      free_ |= 1u << slot;
      return {s_.t[slot][lane_],
              s_.alpha[slot][lane_],
              {s_.red[slot][lane_], s_.green[slot][lane_], s_.blue[slot][lane_]},
              s_.key[slot][lane_]};
    }

    // The slot of the pending hit that is k-th in order.
    __device__ GART_INLINE int slot_of(int k) const { return static_cast<int>(order_ >> (4 * k)) & 15; }

    // Of a full window.
    __device__ GART_INLINE pending take_farthest() {
      int const slot = slot_of(window - 1);
      order_ &= (u64{1} << (4 * (window - 1))) - 1;
      return take_slot(slot);
    }

    __device__ GART_INLINE void put_aside(pending const& h) {
      if (aside_count_ < aside)
        write_aside(aside_count_++, h);
      else if (nearer(h.t, h.key, lost_t_, lost_key_))
        lost_t_ = h.t, lost_key_ = h.key;
    }

    __device__ GART_INLINE void write_aside(int k, pending const& h) {
      float* const to = aside_ + 6 * lanes * k;
      to[0] = h.t, to[lanes] = h.alpha, to[2 * lanes] = bits_to_float(h.key);
      to[3 * lanes] = h.shown.x, to[4 * lanes] = h.shown.y, to[5 * lanes] = h.shown.z;
    }

    __device__ GART_INLINE pending read_aside(int k) const {
      float const* const from = aside_ + 6 * lanes * k;
      return {from[0], from[lanes], {from[3 * lanes], from[4 * lanes], from[5 * lanes]}, aside_key(k)};
    }
    __device__ GART_INLINE float aside_time(int k) const { return aside_[6 * lanes * k]; }
    __device__ GART_INLINE u32 aside_key(int k) const { return float_to_bits(aside_[6 * lanes * k + 2 * lanes]); }

    // The nearest of the hits put aside, as many as there is room for.
    __device__ GART_INLINE void fill() {
      limit_t_ = infinity, limit_key_ = nothing;
      for (int k = 0; k < aside_count_;) {
        if (count_ < window) {
          put(read_aside(k));
          if (k < --aside_count_) write_aside(k, read_aside(aside_count_));
          continue;
        }
        float t = aside_time(k);
        u32 key = aside_key(k);
        int const farthest = slot_of(window - 1);
        float const farthest_t = s_.t[farthest][lane_];
        u32 const farthest_key = s_.key[farthest][lane_];
        if (nearer(t, key, farthest_t, farthest_key)) {
          pending const h = read_aside(k);
          write_aside(k, take_farthest());
          put(h);
          t = farthest_t, key = farthest_key;
        }
        if (nearer(t, key, limit_t_, limit_key_)) limit_t_ = t, limit_key_ = key;
        ++k;
      }
    }

    // Hits nearer than `depth`, which nothing that is left of the list comes before.
    __device__ GART_INLINE void pass_on(float depth) {
      while (true) {
        while (alive_ && count_ > 0) {
          int const slot = slot_of(0);
          float const t = s_.t[slot][lane_];
          if (!(t * cosine_ < depth) || (t >= lost_t_ && !nearer(t, s_.key[slot][lane_], lost_t_, lost_key_))) break;
          order_ >>= 4;
          pending const h = take_slot(slot);
          last_t_ = h.t, last_key_ = h.key;
          alive_ = k_.program.add(state_, h.t, h.alpha, h.shown, P::records_hits ? h.key : 0);
        }
        bool const empty = alive_ && count_ == 0 && aside_count_ > 0 && limit_t_ * cosine_ < depth;
        if (!__any_sync(everyone, empty)) return;
        if (alive_ && aside_count_ > 0 && count_ <= window / 2) fill();
      }
    }

    static constexpr float infinity = __builtin_huge_valf();

    walk_tile_warps const& k_;
    warp_scratch& s_;
    float* aside_;  // [aside][6], a lane's numbers 32 apart
    int lane_;
    pixel_box area_;
    pixel corner_, at_;
    index_t index_;
    primary_ray ray_;
    typename P::state state_;
    float cosine_;
    bool alive_;
    float last_t_;  // the last hit passed on: at first (near, none), t > near
    u32 last_key_ = nothing;
    float limit_t_,
        lost_t_;  // the nearest hit put aside, and the nearest lost: what is pending lies before the one, what
    u32 limit_key_, lost_key_;  // is passed on before the other
    u64 order_;                 // slots of the pending hits, nearest first, 4 bits each
    u32 free_;
    int count_, aside_count_;
  };
};

}  // namespace gart

#endif
