#pragma once
/// \file
/// The hits of a table by Gaussian: sorted, and cut into pieces of one Gaussian each, so that sums over the hits of a
/// Gaussian are sums of a lane, then of its pieces in order. Nothing is atomic; bits are the same in every run.
/// Memory: 8 bytes a hit, 16 a Gaussian. Cost: a sort of 8 bytes a hit by the bits of a Gaussian's number. The host
/// reads how many pieces there are.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/channels/channel.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>

#include <bit>

namespace gart { inline namespace GART_ISA {

/// The order as kernels read it.
struct gaussian_order_view {
  static constexpr u32 piece_hits = 64;  ///< hits of a piece, at most
  u32 const* ids = nullptr;              ///< [hits], ascending
  u32 const* places = nullptr;           ///< [hits]: of the hits in the table
  u32 const* ends = nullptr;             ///< [Gaussians]: past the last hit, where there is one
  u64 const* offsets = nullptr;          ///< [Gaussians + 1]: first piece of each
  u32 const* firsts = nullptr;           ///< [pieces]: first hit
  index_t pieces = 0;                    ///< of all
  u32 hits = 0;                          ///< in all

  /// Past the last hit of a piece.
  GART_HD GART_INLINE u32 end_of(index_t piece) const {
    u32 const first = firsts[piece], end = ends[ids[first]];
    return end - first < piece_hits ? end : first + piece_hits;
  }
};

namespace channel_kernels {

// What a lane of a host reads of hits in this order lies anywhere: asked for some hits ahead, in two steps. By place:
// prefetches what lies at a hit's place; by ray: what its ray has.
template <class ByPlace, class ByRay>
GART_HD GART_INLINE void ask_ahead([[maybe_unused]] gaussian_order_view const& order, [[maybe_unused]] u32 k,
                                   [[maybe_unused]] ByPlace const& by_place, [[maybe_unused]] ByRay const& by_ray) {
#if !defined(__CUDACC__)
  constexpr u32 near = 8, far = 16;
  if (k + far < order.hits) by_place(order.places[k + far]);
  if (k + near < order.hits) by_ray(order.places[k + near]);
#endif
}

struct number_hits {
  u32 const* ids;
  u32 *sorted, *places;
  GART_KERNEL void operator()(index_t k) const { sorted[k] = ids[k], places[k] = k; }
};

// Where each Gaussian's hits begin and end, zero at first: one without hits has none.
struct find_hits {
  u32 const* ids;
  index_t hits;
  u32 *begins, *ends;
  GART_KERNEL void operator()(index_t k) const {
    u32 const here = ids[k];
    if (k == 0 || ids[k - 1] != here) begins[here] = k;
    if (k + 1 == hits || ids[k + 1] != here) ends[here] = k + 1;
  }
};

struct count_hit_pieces {
  u32 const *begins, *ends;
  u32* counts;
  GART_KERNEL void operator()(index_t i) const {
    counts[i] = (ends[i] - begins[i] + gaussian_order_view::piece_hits - 1) / gaussian_order_view::piece_hits;
  }
};

struct cut_hit_pieces {
  u32 const *begins, *ends;
  u64 const* offsets;
  u32* firsts;
  GART_KERNEL void operator()(index_t i) const {
    u64 piece = offsets[i];
    for (u32 k = begins[i]; k < ends[i]; k += gaussian_order_view::piece_hits) firsts[piece++] = k;
  }
};

}  // namespace channel_kernels

/// The order and its memory.
template <execution E>
class gaussian_order {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit gaussian_order(E& exec)
      : ids_(exec), places_(exec), begins_(exec), ends_(exec), counts_(exec), offsets_(exec), firsts_(exec) {}

  /// Of hits of so many Gaussians, by the Gaussian of each.
  void make(E& exec, span<u32 const> ids, index_t gaussians) {
    index_t const hits = static_cast<index_t>(ids.size());
    ids_.resize(hits), places_.resize(hits);
    begins_.resize(gaussians), ends_.resize(gaussians), counts_.resize(gaussians);
    offsets_.resize(std::size_t{gaussians} + 1);
    begins_.zero(), ends_.zero();
    parallel_for(exec, "channels/order", hits, channel_kernels::number_hits{ids.data(), ids_.data(), places_.data()});
    sort_pairs(exec, ids_.view(), places_.view(), static_cast<int>(std::bit_width(gaussians)));
    parallel_for(exec, "channels/order", hits,
                 channel_kernels::find_hits{ids_.data(), hits, begins_.data(), ends_.data()});
    parallel_for(exec, "channels/order", gaussians,
                 channel_kernels::count_hit_pieces{begins_.data(), ends_.data(), counts_.data()});
    span<u64> const at = offsets_.view();
    exclusive_scan(exec, span<u32 const>(counts_), at.subspan(0, gaussians), at.subspan(gaussians, 1));
    u64 pieces = 0;
    exec.copy_out(&pieces, offsets_.data() + gaussians, sizeof pieces);
    firsts_.resize(pieces);
    parallel_for(exec, "channels/order", gaussians,
                 channel_kernels::cut_hit_pieces{begins_.data(), ends_.data(), offsets_.data(), firsts_.data()});
  }
  /// For kernels.
  gaussian_order_view view() const {
    return {ids_.data(),
            places_.data(),
            ends_.data(),
            offsets_.data(),
            firsts_.data(),
            static_cast<index_t>(firsts_.size()),
            static_cast<u32>(ids_.size())};
  }

 private:
  buffer<u32, E> ids_, places_, begins_, ends_, counts_;
  buffer<u64, E> offsets_;
  buffer<u32, E> firsts_;
};

}}  // namespace gart::GART_ISA
