#pragma once
/// \file
/// The backward pass of a batch by primitive. The hits that the forward pass kept (keep_hits) are put in the order of
/// the rays. Then they are sorted by Gaussian and summed. A warp takes a tile of 128 hits, whatever Gaussians they are
/// of. What it sums of a Gaussian that goes past the tile is a part; parts are added up in order. No ray is traced, and
/// nothing is atomic. The order of every sum follows from the hits alone: the same bits in every run.
///
/// Cost: a sort of 8 bytes a hit by as many bits as Gaussians need. Then one read of 32 bytes a hit and 48 of its ray.
/// A row of gradients is written once, of every Gaussian that is hit, after all were set to zero. Memory: 4 bytes a
/// hit.

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/rays/batch_gradient.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/trace/lane_values.hpp>

#include <bit>

namespace gart { inline namespace GART_ISA {

/// The hits of a batch: as the forward pass kept them, by place, and sorted.
template <execution E>
struct kept_batch {
  /// None yet.
  explicit kept_batch(E& exec) : runs(exec), ids(exec), hits(exec), offsets(exec), sorted_ids(exec), places(exec) {}

  hit_runs<E> runs;                   ///< whose the places are
  buffer<u32, E> ids;                 ///< as keep_hits has them
  buffer<kept_hit, E> hits;           ///< the same
  buffer<u64, E> offsets;             ///< [R]: the hits of the rays before
  buffer<u32, E> sorted_ids, places;  ///< by Gaussian, then by ray
  u64 taken = 0;                      ///< places, with those that hold no hit
  u64 count = 0;                      ///< hits
  bool sorted = false;                ///< the order by Gaussian is there
};

/// The hits of rays in the order of their Gaussians. Hits: hits.at(place) is the kept_hit of a place. Trivially
/// copyable.
template <class Hits>
struct sorted_hits {
  Hits hits;                    ///< by place
  u32 const* ids = nullptr;     ///< [count]: Gaussians in order; past the last one: no hit
  u32 const* places = nullptr;  ///< [count]: where the hits are
};

/// Those of a batch by place.
struct batch_hits {
  kept_hit const* hits = nullptr;  ///< as keep_hits has them
  /// Of a place.
  GART_HD GART_INLINE kept_hit at(u32 place) const { return hits[place]; }
};

namespace ray_kernels {

// The hits in the order of the rays.
struct order_by_ray {
  run_reader runs;
  u32 const* ids;
  u32 *to_ids, *to_places;
  GART_KERNEL void operator()(index_t place) const {
    u32 ray_number;
    u64 to;
    if (runs.find(place, ray_number, to)) to_ids[to] = ids[place], to_places[to] = place;
  }
};

// A tile of the sorted hits.
struct hit_tile {
  static constexpr index_t size = 128;
  static constexpr u32 none = ~u32{0};
  index_t first, end;
  u32 before, after;  // Gaussians that the tile before and the next one share, or none

  GART_HD GART_INLINE hit_tile(u32 const* ids, index_t count, index_t number)
      : first(number * size), end(count - first < size ? count : first + size) {
    before = first > 0 && ids[first - 1] == ids[first] ? ids[first] : none;
    after = end < count && ids[end - 1] == ids[end] ? ids[end] : none;
  }
};

// The sums of a Gaussian: three floats a lane. Lanes of the bands have their colours, the others moments.
struct sum_row {
  static constexpr int bands = sh_basis<color_rows::most>::size, lanes = bands + moment_stride / 3;
  float v[3 * lanes];
};
// Where they go.
struct sum_targets {
  u32 gaussians;
  int bands;  // of a row of sh
  float *sh, *moments;

  GART_HD GART_INLINE void write(u32 id, int lane, vec3 const& sum) const {
    if (lane >= sum_row::bands)
      put(moments + std::size_t{moment_stride} * id + 3 * (lane - sum_row::bands), sum);
    else if (lane < bands)
      put(sh + std::size_t{3} * static_cast<std::size_t>(bands) * id + 3 * lane, sum);
  }
  GART_HD GART_INLINE static void put(float* to, vec3 const& v) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }
};

// What a hit adds. A lane's share is a factor times three floats: of a band and the colour, or of 1 and moments.
struct hit_terms {
  float factor[sum_row::bands + 4];
  quad three[1 + moment_stride / 3];
};

// The sums of a Gaussian as hits are added. A lane of a device has its three floats in registers. A host has an array
// of each of the three, so that the compiler adds many bands at once.
class growing_row {
 public:
  // `first`: of another Gaussian than the hit before.
  GART_HD GART_INLINE void add(hit_terms const& hit, bool first) {
    constexpr int bands = sum_row::bands;
#if defined(__CUDA_ARCH__)
    each_lane([&](int l) {
      if (l >= sum_row::lanes) return;
      float const f = hit.factor[l < bands ? l : bands];
      quad const three = hit.three[l < bands ? 0 : l - bands + 1];
      if (first) sum_ = vec3(0.0f);
      sum_ += f * vec3(three.v[0], three.v[1], three.v[2]);
    });
#else
    for (int l = 0; first && l < sum_row::lanes; ++l) x_[l] = y_[l] = z_[l] = 0;
    quad const color = hit.three[0];
    for (int b = 0; b < bands; ++b) x_[b] += hit.factor[b] * color.v[0];
    for (int b = 0; b < bands; ++b) y_[b] += hit.factor[b] * color.v[1];
    for (int b = 0; b < bands; ++b) z_[b] += hit.factor[b] * color.v[2];
    for (int i = 0; i < sum_row::lanes - bands; ++i) {
      quad const moments = hit.three[1 + i];
      x_[bands + i] += moments.v[0], y_[bands + i] += moments.v[1], z_[bands + i] += moments.v[2];
    }
#endif
  }
  // Of a lane; on a device of the calling one.
  GART_HD GART_INLINE vec3 of([[maybe_unused]] int lane) const {
#if defined(__CUDA_ARCH__)
    return sum_;
#else
    return vec3(x_[lane], y_[lane], z_[lane]);
#endif
  }

 private:
#if defined(__CUDA_ARCH__)
  vec3 sum_;
#else
  float x_[sum_row::lanes], y_[sum_row::lanes], z_[sum_row::lanes];
#endif
};

// Lanes take a hit each and put down what it adds. Then they take three floats of the row each and go through the hits.
// So all lanes work, however few hits a Gaussian has, and a row is written at once.
template <class Response, class Hits>
struct sum_tile {
  static constexpr int block_size = beam_lanes, min_blocks = 32;
  static constexpr int bands = sum_row::bands;
  sorted_hits<Hits> hits;
  index_t count;
  differentiated_ray const* rays;
  ray_gaussian const* records;
  int active_bands;
  sum_targets out;
  sum_row* parts;  // [tiles][2]: of a Gaussian that began before, of one that ends after

  struct scratch {
    hit_terms hits[beam_lanes];
    u32 ids[beam_lanes];
  };

  GART_KERNEL void operator()(auto const& team) const {
    scratch& s = team.scratch();
    hit_tile const tile(hits.ids, count, team.tile());
    growing_row sum;
    u32 id = hit_tile::none;
    for (index_t k = tile.first; k < tile.end; k += beam_lanes) {
      int const n = tile.end - k < beam_lanes ? static_cast<int>(tile.end - k) : beam_lanes;
      each_lane([&](int l) {
        if (l < n) s.ids[l] = put(k + static_cast<index_t>(l), s.hits[l]);
      });
      team.barrier();
      for (int j = 0; j < n; ++j) {
        bool const other = s.ids[j] != id;
        if (other) write(team.tile(), tile, id, sum), id = s.ids[j];
        sum.add(s.hits[j], other);
      }
      team.barrier();
    }
    write(team.tile(), tile, id, sum);
  }

 private:
  GART_HD GART_INLINE void write(index_t number, hit_tile const& tile, u32 id, growing_row const& sum) const {
    if (id >= out.gaussians) return;
    each_lane([&](int l) {
      if (l >= sum_row::lanes) return;
      if (id == tile.before || id == tile.after)
        out.put(parts[std::size_t{2} * number + (id != tile.before)].v + 3 * l, sum.of(l));
      else
        out.write(id, l, sum.of(l));
    });
  }
  // Of a hit; its Gaussian.
  GART_HD GART_INLINE u32 put(index_t k, hit_terms& to) const {
    u32 const id = hits.ids[k];
    if (id >= out.gaussians) return id;
    kept_hit const hit = hits.hits.at(hits.places[k]);
    differentiated_ray const from = rays[hit.ray_number];
    ray_gaussian const gaussian = records[id];
    ray_peak const r = evaluate(gaussian, from.own());
    float const by_alpha = alpha_gradient_of<Response>(hit.entry, hit.depth, from, gaussian, r);
    moments_of<float> const m =
        hit_moments_with_depth<Response>(gaussian, r, by_alpha, hit.entry.weight() * from.by_depth, true);
    vec3 const c = color_gradient_of(hit.entry, from.by_color);
    to.three[0] = {{c.x, c.y, c.z, 0}};
    GART_UNROLL
    for (int i = 0; i < moment_stride; i += 3) to.three[1 + i / 3] = {{m.v[i], m.v[i + 1], m.v[i + 2], 0}};
    sh_basis<color_rows::most> const basis(from.direction);
    GART_UNROLL
    for (int b = 0; b < bands; ++b) to.factor[b] = b < active_bands ? basis.y[b] : 0.0f;
    to.factor[bands] = 1;
    return id;
  }
};

// A Gaussian that passes the end of a tile: its parts, in order. An index a lane of the tile that it begins in.
struct join_parts {
  u32 const* ids;
  index_t count;
  sum_row const* parts;
  sum_targets out;
  GART_KERNEL void operator()(index_t index) const {
    index_t number = index / sum_row::lanes;
    int const lane = static_cast<int>(index % sum_row::lanes);
    hit_tile const tile(ids, count, number);
    u32 const id = tile.after;
    if (id >= out.gaussians || id == tile.before) return;
    auto const part = [&](std::size_t row) {
      float const* const v = parts[row].v + 3 * lane;
      return vec3(v[0], v[1], v[2]);
    };
    vec3 sum = part(std::size_t{2} * number + 1);
    for (bool more = true; more;) {
      sum += part(std::size_t{2} * ++number);
      more = hit_tile(ids, count, number).after == id;
    }
    out.write(id, lane, sum);
  }
};

}  // namespace ray_kernels

/// The memory of the sums, kept from one batch to the next.
template <execution E, class Response>
class batch_gather {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit batch_gather(E& exec) : parts_(exec) {}

  /// Overwrites gradients.sh, and moments, [N][moment_stride]. `records`: the Gaussians in the batch's frame. Sorts
  /// the hits, where they are not.
  void operator()(E& exec, kept_batch<E>& hits, span<differentiated_ray const> rays, span<ray_gaussian const> records,
                  int active_degree, gaussians_view<float> gradients, span<float> moments) {
    index_t const n = static_cast<index_t>(hits.count);
    if (gradients.count == 0) return;
    sort(exec, hits, n, gradients.count);
    sum(exec, sorted_hits<batch_hits>{{hits.hits.data()}, hits.sorted_ids.data(), hits.places.data()}, n, rays, records,
        active_degree, gradients, moments);
  }

  /// The same of n hits that are in order.
  template <class Hits>
  void sum(E& exec, sorted_hits<Hits> const& hits, index_t n, span<differentiated_ray const> rays,
           span<ray_gaussian const> records, int active_degree, gaussians_view<float> gradients, span<float> moments) {
    ray_kernels::sum_targets const out{gradients.count, sh_coefficients(gradients.sh_degree), gradients.sh,
                                       moments.data()};
    exec.zero(out.sh, sizeof(float) * gradients.count * static_cast<std::size_t>(gradients.sh_stride()));
    exec.zero(out.moments, sizeof(float) * gradients.count * std::size_t{moment_stride});
    index_t const tiles = n / tile_hits + (n % tile_hits != 0);
    parts_.resize(std::size_t{2} * tiles);
    parallel_for(exec, "rays/gather", tile_range{tiles, static_cast<index_t>(beam_lanes)},
                 ray_kernels::sum_tile<Response, Hits>{hits, n, rays.data(), records.data(),
                                                       sh_coefficients(active_degree), out, parts_.data()});
    parallel_for(exec, "rays/sum", tiles * static_cast<index_t>(ray_kernels::sum_row::lanes),
                 ray_kernels::join_parts{hits.ids, n, parts_.data(), out});
  }

 private:
  static void sort(E& exec, kept_batch<E>& hits, index_t n, index_t gaussians) {
    if (hits.sorted) return;
    hits.sorted_ids.resize(n), hits.places.resize(n);
    parallel_for(exec, "rays/places", static_cast<index_t>(hits.taken),
                 ray_kernels::order_by_ray{hits.runs.read(hits.offsets.data()), hits.ids.data(), hits.sorted_ids.data(),
                                           hits.places.data()});
    sort_pairs(exec, hits.sorted_ids, hits.places, static_cast<int>(std::bit_width(gaussians - 1)));
    hits.sorted = true;
  }
  static constexpr index_t tile_hits = ray_kernels::hit_tile::size;
  buffer<ray_kernels::sum_row, E> parts_;
};

}}  // namespace gart::GART_ISA
