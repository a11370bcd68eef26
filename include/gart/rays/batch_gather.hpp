#pragma once
/// \file
/// The backward pass of a batch by primitive. The hits that the forward pass kept (keep_hits) are put in the order of
/// the rays. Then they are sorted by Gaussian, cut into pieces of one Gaussian each, and summed. A lane takes a piece,
/// then the pieces of a Gaussian are added up in order. No ray is traced, and nothing is atomic. The order of every sum
/// follows from the hits alone: the same bits in every run.
///
/// Cost: a sort of 8 bytes a hit by as many bits as Gaussians need. Then one read of 20 bytes a hit and 48 of its ray.
/// Also 240 bytes a piece of 32 hits at SH degree 3. The host reads how many pieces there are.

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/backward/gather.hpp>
#include <gart/channels/hit_pieces.hpp>
#include <gart/rays/batch_gradient.hpp>

#include <bit>

namespace gart { inline namespace GART_ISA {

/// The hits of a batch: as the forward pass kept them, by place, and sorted.
template <execution E>
struct kept_batch {
  /// None yet.
  explicit kept_batch(E& exec)
      : runs(exec), ids(exec), entries(exec), depths(exec), offsets(exec), sorted_ids(exec), places(exec) {}

  hit_runs<E> runs;                   ///< whose the places are
  buffer<u32, E> ids;                 ///< as keep_hits has them
  buffer<hit_entry, E> entries;       ///< the same
  buffer<float, E> depths;            ///< the same
  buffer<u64, E> offsets;             ///< [R]: the hits of the rays before
  buffer<u32, E> sorted_ids, places;  ///< by Gaussian, then by ray
  u64 taken = 0;                      ///< places, with those that hold no hit
  u64 count = 0;                      ///< hits
  bool sorted = false;                ///< the order by Gaussian is there
};

/// The hits of rays in the order of their Gaussians. Owner: owner.ray_of(place) is the ray of a place. Trivially
/// copyable.
template <class Owner>
struct sorted_hits {
  Owner owner;                         ///< whose the places are
  u32 const* ids = nullptr;            ///< [count]: Gaussians in order; past the last one: no hit
  u32 const* places = nullptr;         ///< [count]: where the hits are
  hit_entry const* entries = nullptr;  ///< by place
  float const* depths = nullptr;       ///< by place
};

namespace ray_kernels {

inline constexpr u32 piece_hits = 32;

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

// Rows are laid out as pair_gradient has them, so that sum_pairs adds them up.
template <class Response, class Owner>
struct sum_piece {
  static constexpr int block_size = 64, min_blocks = 8;
  static constexpr int bands = sh_basis<color_rows::most>::size;
  sorted_hits<Owner> hits;
  u32 const *firsts, *ends;
  differentiated_ray const* rays;
  ray_gaussian const* records;
  int sh_floats, active_floats;  // of a row of gradients; of those the active bands
  quad* rows;

  GART_KERNEL void operator()(index_t piece) const {
    u32 const first = firsts[piece], id = hits.ids[first];
    u32 const end = ends[id] - first < piece_hits ? ends[id] : first + piece_hits;
    ray_gaussian const gaussian = records[id];
    float color[3 * bands] = {}, moment[moment_stride] = {};
    for (u32 k = first; k < end; ++k) add(k, gaussian, color, moment);
    int const sh_quads = (sh_floats + 3) / 4;
    quad* const row = rows + static_cast<std::size_t>(piece) * static_cast<std::size_t>(sh_quads + moment_stride / 4);
    GART_UNROLL
    for (int q = 0; q < (3 * bands + 3) / 4; ++q)
      if (q < sh_quads) {
        quad four;
        GART_UNROLL
        for (int i = 0; i < 4; ++i) four.v[i] = 4 * q + i < active_floats ? color[4 * q + i] : 0.0f;
        row[q] = four;
      }
    GART_UNROLL
    for (int q = 0; q < moment_stride / 4; ++q)
      row[sh_quads + q] = {moment[4 * q], moment[4 * q + 1], moment[4 * q + 2], moment[4 * q + 3]};
  }

 private:
  GART_HD GART_INLINE void add(u32 k, ray_gaussian const& gaussian, float (&color)[3 * bands],
                               float (&moment)[moment_stride]) const {
    u32 const place = hits.places[k];
    hit_entry const entry = hits.entries[place];
    differentiated_ray const from = rays[hits.owner.ray_of(place)];
    vec3 const c = color_gradient_of(entry, from.by_color);
    sh_basis<color_rows::most> const basis(from.direction);
    GART_UNROLL
    for (int b = 0; b < bands; ++b) {
      if (3 * b >= active_floats) break;
      color[3 * b] += basis.y[b] * c.x, color[3 * b + 1] += basis.y[b] * c.y, color[3 * b + 2] += basis.y[b] * c.z;
    }
    ray_peak const r = evaluate(gaussian, from.own());
    float const by_alpha = alpha_gradient_of<Response>(entry, hits.depths[place], from, gaussian, r);
    moments_of<float> const m =
        hit_moments_with_depth<Response>(gaussian, r, by_alpha, entry.weight() * from.by_depth, true);
    GART_UNROLL
    for (int i = 0; i < error_place; ++i) moment[i] += m.v[i];
  }
};

}  // namespace ray_kernels

/// The memory of the sums, kept from one batch to the next.
template <execution E, class Response>
class batch_gather {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit batch_gather(E& exec) : pieces_(exec), rows_(exec) {}

  /// Overwrites gradients.sh, and moments, [N][moment_stride]. `records`: the Gaussians in the batch's frame. Sorts
  /// the hits, where they are not.
  void operator()(E& exec, kept_batch<E>& hits, span<differentiated_ray const> rays, span<ray_gaussian const> records,
                  int active_degree, gaussians_view<float> gradients, span<float> moments) {
    index_t const n = static_cast<index_t>(hits.count);
    if (gradients.count == 0) return;
    sort(exec, hits, n, gradients.count);
    run_reader const runs = hits.runs.read(hits.offsets.data());
    sum(exec,
        sorted_hits<run_reader>{runs, hits.sorted_ids.data(), hits.places.data(), hits.entries.data(),
                                hits.depths.data()},
        n, rays, records, active_degree, gradients, moments);
  }

  /// The same of n hits that are in order.
  template <class Owner>
  void sum(E& exec, sorted_hits<Owner> const& hits, index_t n, span<differentiated_ray const> rays,
           span<ray_gaussian const> records, int active_degree, gaussians_view<float> gradients, span<float> moments) {
    pieces_.cut(exec, "rays/pieces", channel_kernels::id_of_hit{hits.ids}, n, gradients.count, ray_kernels::piece_hits);
    index_t const pieces = pieces_.count();
    int const sh_floats = gradients.sh_stride();
    rows_.resize(u64{pieces} * static_cast<u64>((sh_floats + 3) / 4 + moment_stride / 4));
    parallel_for(
        exec, "rays/gather", pieces,
        ray_kernels::sum_piece<Response, Owner>{hits, pieces_.firsts(), pieces_.ends(), rays.data(), records.data(),
                                                sh_floats, 3 * sh_coefficients(active_degree), rows_.data()});
    switch (gradients.sh_degree) {
      case 0:
        return add_up<0>(exec, pieces, gradients, moments);
      case 1:
        return add_up<1>(exec, pieces, gradients, moments);
      case 2:
        return add_up<2>(exec, pieces, gradients, moments);
      default:
        return add_up<3>(exec, pieces, gradients, moments);
    }
  }

 private:
  static void sort(E& exec, kept_batch<E>& hits, index_t n, index_t gaussians) {
    if (hits.sorted) return;
    hits.sorted_ids.resize(n), hits.places.resize(n);
    parallel_for(exec, "rays/places", static_cast<index_t>(hits.taken),
                 ray_kernels::order_by_ray{hits.runs.read(hits.offsets.data()), hits.ids.data(), hits.sorted_ids.data(),
                                           hits.places.data()});
    sort_pairs(exec, hits.sorted_ids.view(), hits.places.view(), static_cast<int>(std::bit_width(gaussians - 1)));
    hits.sorted = true;
  }
  template <int Degree>
  void add_up(E& exec, u64 pieces, gaussians_view<float> gradients, span<float> moments) {
    parallel_for(
        exec, "rays/sum", gradients.count * static_cast<index_t>(pair_gradient<Degree>::quads),
        sum_pairs<Degree, terms<term::color, term::geometry>>{pieces_.offsets().subspan(0, gradients.count), pieces,
                                                              rows_.data(), gradients.sh, moments.data()});
  }

  hit_pieces<E> pieces_;
  buffer<quad, E> rows_;
};

}}  // namespace gart::GART_ISA
