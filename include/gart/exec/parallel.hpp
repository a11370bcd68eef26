#pragma once
/// \file
/// Labelled launches on the host policies: parallel_for over indices and over tiles. The CUDA twins are in
/// cuda_launch.cuh; a tile kernel is the same source on both.
///
/// A tile kernel is written in phases. team.for_each(n, f) shares f(0..n) out over the team's lanes; team.barrier()
/// makes what was written to team.scratch() visible to all. There is no lane id, so one lane is a correct host mapping.
/// Scratch is undefined when a tile begins. Nothing to do is no launch, on every policy.
///
/// Kernels run on many threads and must not throw.

#include <gart/exec/openmp.hpp>
#include <gart/exec/serial.hpp>
#include <gart/exec/stage.hpp>

#include <algorithm>
#include <memory>

namespace gart { inline namespace GART_ISA {

/// The team of a tile on a host: one lane.
template <class Scratch>
class host_team {
 public:
  /// Of a tile, with the scratch that it works in.
  host_team(index_t tile, Scratch& scratch) : tile_(tile), scratch_(scratch) {}
  /// Its number.
  index_t tile() const { return tile_; }
  /// The scratch, which all lanes share.
  Scratch& scratch() const { return scratch_; }
  /// All lanes have come here; on a host the one has.
  void barrier() const {}
  /// f(0) to f(n - 1), shared out over the lanes.
  template <class F>
  void for_each(index_t n, F&& f) const {
    for (index_t i = 0; i < n; ++i) f(i);
  }

 private:
  index_t tile_;
  Scratch& scratch_;
};

///@{
/// kernel(i) for i in [0, n).
template <index_kernel K>
void parallel_for(serial_exec& exec, char const* label, index_t n, K const& kernel) {
  if (n == 0) return;
  stage_scope scope(exec, label);
  for (index_t i = 0; i < n; ++i) kernel(i);
}

template <index_kernel K>
void parallel_for(openmp_exec& exec, char const* label, index_t n, K const& kernel) {
  if (n == 0) return;
  stage_scope scope(exec, label);
  // Dynamic chunks: rays differ in cost by orders of magnitude; 256 indices amortise the fetch of a chunk.
#if defined(_OPENMP)
#pragma omp parallel for schedule(dynamic, 256) num_threads(exec.threads())
#endif
  for (index_t i = 0; i < n; ++i) kernel(i);
}
///@}

///@{
/// kernel(team) for each tile.
template <tile_kernel K>
void parallel_for(serial_exec& exec, char const* label, tile_range range, K const& kernel) {
  if (range.tiles == 0) return;
  stage_scope scope(exec, label);
  auto scratch = std::make_unique_for_overwrite<typename K::scratch>();
  for (index_t t = 0; t < range.tiles; ++t) {
    host_team<typename K::scratch> team(t, *scratch);
    kernel(team);
  }
}

template <tile_kernel K>
void parallel_for(openmp_exec& exec, char const* label, tile_range range, K const& kernel) {
  if (range.tiles == 0) return;
  stage_scope scope(exec, label);
  // Neighbouring tiles go to one thread. They write to the same Gaussians. Cache lines shared by cores cost more than
  // an uneven share of the work.
  [[maybe_unused]] index_t const chunk = std::max<index_t>(1, range.tiles / static_cast<index_t>(16 * exec.threads()));
#if defined(_OPENMP)
#pragma omp parallel num_threads(exec.threads())
#endif
  {
    auto scratch = std::make_unique_for_overwrite<typename K::scratch>();
#if defined(_OPENMP)
#pragma omp for schedule(dynamic, chunk)
#endif
    for (index_t t = 0; t < range.tiles; ++t) {
      host_team<typename K::scratch> team(t, *scratch);
      kernel(team);
    }
  }
}
///@}

}}  // namespace gart::GART_ISA
