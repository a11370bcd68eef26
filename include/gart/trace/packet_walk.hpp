#pragma once
// The walk of tile lists on a host: rays in packets, a lane a pixel (math/lanes.hpp). The same as walk_tiles
// (trace/tile_tracer.hpp), hit by hit and bit by bit; what differs is that a candidate is evaluated for all rays of a
// packet at once, that the hits found and not yet passed on are kept in rows sorted lane by lane, and that what a hit
// shows is computed as it is found, where its Gaussian is the same for all lanes.
//
// A packet program is the ray program for packets:
//   channels                      floats that `shade` computes a lane
//   begin(block)                  the state of a block's rays; says `directions` and which lanes are `inside`
//   shade(state, id, tile, out, note)  what the Gaussian shows each ray, and what all its hits share
//   on_hits(state, lanes, hits)   composites one hit in each lane of a mask; the lanes of it that go on
//   end(state)
// A packet whose rows run over (more than `window` hits pending on a ray) says so, and its rays are traced one by one.

#include <gart/math/lanes.hpp>
#include <gart/math/ray_gaussian.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/ray_program.hpp>

#if !defined(__CUDACC__)

namespace gart {

// The pixels of a packet: 4 wide, as high as there are lanes for.
struct packet_block {
  static constexpr int width = 4, height = lane_count / width;
  int x = 0, y = 0;

  static constexpr int column(int lane) { return lane % width; }
  static constexpr int row(int lane) { return lane / width; }
  bool overlaps(pixel_box const& b) const { return b.x0 < x + width && b.x1 > x && b.y0 < y + height && b.y1 > y; }
};

// One hit a lane.
template <class P>
struct packet_hits {
  lanes t, alpha;
  lanes shade[P::channels];
  lane_ints id;
  lane_ints row;  // of `notes`
  typename P::note const* notes;
};

// Window: what a ray traced alone keeps (tile_tracer). A packet keeps eight times that: what runs over is traced again
// from the start, not resumed.
template <class Response, int Window, int Size, class P>
class packet_walk {
 public:
  static constexpr int window = 8 * Window;
  static_assert(Size % packet_block::width == 0 && Size % packet_block::height == 0);

  // False where a ray had more hits pending than there is room for; nothing then counts.
  bool operator()(P const& program, traced_scene const& scene, tile_map_view const& map, lt_range const* ranges,
                  vec3 const& forward, pixel_box const& tile, u32 tile_index, packet_block block) {
    auto state = program.begin(block);
    vec3_of<lanes> const& d = state.directions;
    // z = t * cosine; rounded up, so that what is said to lie nearer than a depth does.
    lanes const cosine = (d.x * lanes(forward.x) + d.y * lanes(forward.y) + d.z * lanes(forward.z)) * lanes(1.000002f);
    alive_ = state.inside, count_ = lane_ints{}, top_ = 0;
    free_all();
    u32 const* const list = map.primitives.data();
    u32 const end = map.offsets[tile_index + 1];
    int since = 0;
    for (u32 k = map.offsets[tile_index]; k < end; ++k) {
      u32 const id = list[k];
      if (!block.overlaps(ranges[id].box)) continue;
      if (++since >= stride && top_ >= often) {
        since = 0;
        pass_on(program, state, cosine, map.depth(k));
        if (!any(alive_)) break;
      }
      ray_gaussian const& g = scene.gaussians[id];
      response_of<lanes> const r = evaluate<Response>(g, primary_ray_of<lanes>{d});
      lane_mask const hit = alive_ & is_hit(g, r, scene.near);
      if (!any(hit)) continue;
      if (free_count_ == 0 && !sweep()) return false;
      int const row = free_[--free_count_];
      ids_[row] = static_cast<int>(id);
      pool_[row].alpha = hit_alpha<Response>(g, r.d2);
      program.shade(state, id, tile, pool_[row].shade, notes_[row]);
      if (!insert(hit, r.t, row)) return false;
    }
    pass_on(program, state, cosine, everything);
    program.end(state);
    return true;
  }

 private:
  static constexpr int stride = 8;  // candidates between two looks at what has become certain
  static constexpr int often = 12;  // pending hits of some ray below which looking does not pay
  static constexpr int rows = 2 * window;
  static constexpr float infinity = 3.402823466e38f;
  static constexpr float everything = -1;  // no bound: the list is at its end

  struct pending {
    lanes t;
    lane_ints row;
  };
  struct shaded {
    lanes alpha;
    lanes shade[P::channels];
  };

  void free_all() {
    for (free_count_ = 0; free_count_ < rows; ++free_count_) free_[free_count_] = static_cast<short>(free_count_);
  }

  // Rows that no pending hit of a living ray refers to are free again.
  bool sweep() {
    bool used[rows] = {};
    for (int l = 0; l < lane_count; ++l)
      for (int k = 0; alive_[l] && k < count_[l]; ++k) used[pending_[k].row[l]] = true;
    for (int r = 0; r < rows; ++r)
      if (!used[r]) free_[free_count_++] = static_cast<short>(r);
    return free_count_ > 0;
  }

  // Every lane of the mask gets a hit at its place by (t, id); from the back, where most belong.
  bool insert(lane_mask left, lanes t, int row) {
    count_ -= left;
    if (any(left & (count_ > every_lane(top_)))) {
      if (top_ == window) return false;
      pending_[top_].t = infinity, pending_[top_].row = lane_ints{};
      ++top_;
    }
    lane_ints const here = every_lane(row);
    for (int k = top_ - 1; k > 0; --k) {
      pending const& nearer = pending_[k - 1];
      lane_mask before = t < nearer.t;
      lane_mask const tie = left & (t == nearer.t);
      if (any(tie)) [[unlikely]]
        for (int l = 0; l < lane_count; ++l)
          if (tie[l] && ids_[row] < ids_[nearer.row[l]]) before[l] = -1;
      before &= left;
      pending_[k].t = select(before, nearer.t, select(left, t, pending_[k].t));
      pending_[k].row = select(before, nearer.row, select(left, here, pending_[k].row));
      left = before;
      if (!any(left)) return true;
    }
    pending_[0].t = select(left, t, pending_[0].t);
    pending_[0].row = select(left, here, pending_[0].row);
    return true;
  }

  // Hits nearer than all that is left of the list go to the program, one a lane at a time.
  template <class State>
  void pass_on(P const& program, State& state, lanes const& cosine, float bound) {
    lane_ints passed{};
    int k = 0;
    for (; k < top_; ++k) {
      pending const& p = pending_[k];
      lane_mask now = alive_ & (count_ > every_lane(k));
      if (bound != everything) now &= p.t * cosine < lanes(bound);
      if (!any(now)) break;
      packet_hits<P> hits;
      hits.t = p.t, hits.row = p.row, hits.notes = notes_;
      lane_ints const at = p.row * static_cast<int>(sizeof(shaded) / sizeof(float)) + lane_numbers();
      float const* const pool = reinterpret_cast<float const*>(pool_);
      hits.alpha = read(pool, at);
      for (int c = 0; c < P::channels; ++c) hits.shade[c] = read(pool + (c + 1) * lane_count, at);
      hits.id = read(ids_, p.row);
      passed -= now;
      alive_ &= program.on_hits(state, now, hits) | ~now;
    }
    if (k > 0) drop(passed, k);
  }

  // Takes the first `passed` hits of each lane away, by powers of two.
  void drop(lane_ints passed, int most) {
    for (int bit = 1; bit <= most; bit *= 2) {
      lane_mask const moves = (passed & every_lane(bit)) != 0;
      if (!any(moves)) continue;
      for (int k = 0; k < top_; ++k) {
        bool const within = k + bit < top_;
        pending_[k].t = select(moves, within ? pending_[k + bit].t : lanes(infinity), pending_[k].t);
        if (within) pending_[k].row = select(moves, pending_[k + bit].row, pending_[k].row);
      }
    }
    count_ -= passed;
    top_ = 0;
    for (int l = 0; l < lane_count; ++l)
      if (alive_[l] && count_[l] > top_) top_ = count_[l];
  }

  lane_mask alive_;
  lane_ints count_;  // hits pending a lane; beyond it t is infinite
  int top_ = 0;      // the largest count
  int free_count_ = 0;
  pending pending_[window];
  shaded pool_[rows];  // by row: one candidate's
  int ids_[rows];
  typename P::note notes_[rows];
  short free_[rows];
};

}  // namespace gart

#endif
