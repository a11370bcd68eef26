#pragma once
/// \file
/// Hits that are sorted by Gaussian, cut into pieces of one Gaussian each. A lane sums a piece; then the pieces of a
/// Gaussian are added up in order. Nothing is atomic; bits are the same in every run. Memory: 20 bytes a Gaussian and 4
/// a piece. The host reads how many pieces there are.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>

namespace gart { inline namespace GART_ISA {

namespace channel_kernels {

// Where each Gaussian's hits begin and end, zero at first: one without hits has none. What is of no Gaussian has a
// number past all.
template <class Ids>
struct find_hits {
  Ids id;  // id(k): whose sorted hit k is
  index_t hits, gaussians;
  u32 *begins, *ends;
  GART_KERNEL void operator()(index_t k) const {
    auto const here = id(k);
    if (here >= gaussians) return;
    if (k == 0 || id(k - 1) != here) begins[here] = k;
    if (k + 1 == hits || id(k + 1) != here) ends[here] = k + 1;
  }
};

struct count_pieces {
  u32 const *begins, *ends;
  u32 piece_hits;
  u32* counts;
  GART_KERNEL void operator()(index_t i) const { counts[i] = (ends[i] - begins[i] + piece_hits - 1) / piece_hits; }
};

struct cut_pieces {
  u32 const *begins, *ends;
  u64 const* offsets;
  u32 piece_hits;
  u32* firsts;
  GART_KERNEL void operator()(index_t i) const {
    u64 piece = offsets[i];
    for (u32 k = begins[i]; k < ends[i]; k += piece_hits) firsts[piece++] = k;
  }
};

}  // namespace channel_kernels

/// The pieces and their memory.
template <execution E>
class hit_pieces {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit hit_pieces(E& exec) : begins_(exec), ends_(exec), counts_(exec), offsets_(exec), firsts_(exec) {}

  /// Of sorted hits, at most piece_hits in each; id(k) is the Gaussian of hit k. Label: of the launches.
  template <class Ids>
  void cut(E& exec, char const* label, Ids const& id, index_t hits, index_t gaussians, u32 piece_hits) {
    begins_.resize(gaussians), ends_.resize(gaussians), counts_.resize(gaussians);
    offsets_.resize(std::size_t{gaussians} + 1);
    begins_.zero(), ends_.zero();
    parallel_for(exec, label, hits, channel_kernels::find_hits<Ids>{id, hits, gaussians, begins_.data(), ends_.data()});
    parallel_for(exec, label, gaussians,
                 channel_kernels::count_pieces{begins_.data(), ends_.data(), piece_hits, counts_.data()});
    span<u64> const at = offsets_.view();
    exclusive_scan(exec, span<u32 const>(counts_), at.subspan(0, gaussians), at.subspan(gaussians, 1));
    u64 pieces = 0;
    exec.copy_out(&pieces, offsets_.data() + gaussians, sizeof pieces);
    firsts_.resize(pieces);
    parallel_for(
        exec, label, gaussians,
        channel_kernels::cut_pieces{begins_.data(), ends_.data(), offsets_.data(), piece_hits, firsts_.data()});
  }
  /// [Gaussians]: past the last hit of each, where there is one.
  u32 const* ends() const { return ends_.data(); }
  /// [Gaussians + 1]: the first piece of each.
  span<u64 const> offsets() const { return offsets_; }
  /// [count()]: the first hit of each piece.
  u32 const* firsts() const { return firsts_.data(); }
  /// Of all Gaussians.
  index_t count() const { return static_cast<index_t>(firsts_.size()); }

 private:
  buffer<u32, E> begins_, ends_, counts_;
  buffer<u64, E> offsets_;
  buffer<u32, E> firsts_;
};

}}  // namespace gart::GART_ISA
