#pragma once
/// \file
/// What a training needs of memory at the least, known before it starts: of each Gaussian that it may grow to, its
/// parameters, their gradients and Adam's two moments, 16 bytes a float, and what a step has of it whether it is seen
/// or not. Over ranks Gaussians are spread in whole blocks (comm/row_owners.hpp). Lists, images, the LT buffer and,
/// over ranks, the rows of others come on top: they depend on the views, and a step that finds no room for the LT
/// buffer is done with less. Parameters, gradients and moments of all that it may grow to are made at the start.
///
/// Errors: out_of_memory, in bytes, before anything is allocated; invalid_argument for more Gaussians than a rank has
/// numbers for.

#include <gart/comm/communicator.hpp>
#include <gart/comm/row_owners.hpp>
#include <gart/core/error.hpp>
#include <gart/io/dataset.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/optim/error_growth.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/shard/row_exchange_kernels.hpp>
#include <gart/train/options.hpp>

#include <algorithm>
#include <string>

namespace gart::inline GART_ISA {

/// The Gaussians that a run may come to, which starts with so many: as many as it is to grow to.
inline u64 gaussians_at_end(train_options const& options, dataset const& data, u64 start) {
  switch (options.densify) {
    case densify_kind::error:
      return std::max<u64>(start, growth_budget(options.error, options.max_gaussians, data.training_pixels()));
    case densify_kind::mcmc:
      return std::max<u64>(start, options.max_gaussians);
    default:  // stays as it is, or grows by what it finds
      return start;
  }
}

/// Bytes of a Gaussian on the rank that has it, for ranks that share steps of `batch` images.
inline u64 bytes_of_gaussian(int sh_degree, int ranks, int batch) {
  u64 const floats = 11 + 3 * static_cast<u64>(sh_degree + 1) * static_cast<u64>(sh_degree + 1);
  int const views = std::min(batch, ranks);  // of a round
  u64 bytes = 16 * floats;
  // Its record in a view and its moments there; where ranks trace whole views they have these of what a view shows.
  if (ranks == 1 || views < ranks) bytes += sizeof(ray_gaussian) + moment_stride * sizeof(float);
  if (ranks > 1) bytes += detail::exchange_bytes_of_row(views, ranks);
  return bytes;
}

/// Bytes of the rank that has most, for so many Gaussians on `ranks` ranks.
inline u64 least_bytes(u64 gaussians, int sh_degree, int ranks, index_t block, int batch) {
  return bytes_of_gaussian(sh_degree, ranks, batch) * row_owners{ranks, 0, block}.owned(gaussians);
}

/// Throws where the policy has not even that, of what it shares with other ranks.
template <execution E, class Comm>
void require_room(E& exec, Comm& comm, train_options const& options, dataset const& data, int sh_degree, u64 start) {
  u64 const free = exec.free_bytes() / static_cast<u64>(comm.sharers()),
            gaussians = gaussians_at_end(options, data, start);
  index_t const block = std::max<index_t>(options.shard_block, 1);
  if (row_owners{comm.size(), 0, block}.owned(gaussians) > most_gaussians)
    throw invalid_argument("train_options.max_gaussians: " + std::to_string(gaussians) + " Gaussians on " +
                           std::to_string(comm.size()) + (comm.size() == 1 ? " rank" : " ranks") +
                           " are more than the " + std::to_string(most_gaussians) +
                           " that a rank can hold; lower it, or take more ranks");
  // What dropout shows of a Gaussian, and how narrow a filter is there: a float each.
  u64 const floats = (options.dropout > 0 ? 1u : 0u) + (options.render.antialias > 0 ? 1u : 0u);
  u64 const need = least_bytes(gaussians, sh_degree, comm.size(), block, options.batch) +
                   sizeof(float) * floats * row_owners{comm.size(), 0, block}.owned(gaussians);
  if (free == 0 || need <= free) return;
  u64 const fit = free / (need / std::max<u64>(gaussians, 1) + 1);
  throw out_of_memory(E::device ? "CUDA device" : "host", need, free,
                      std::to_string(gaussians) + " Gaussians of degree " + std::to_string(sh_degree) + " on " +
                          std::to_string(comm.size()) + (comm.size() == 1 ? " rank" : " ranks") +
                          " need that much at the least; lower train_options.max_gaussians to less than " +
                          std::to_string(fit) + ", or the degree, or take more ranks");
}

}  // namespace gart::inline GART_ISA
