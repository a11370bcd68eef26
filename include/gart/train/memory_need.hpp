#pragma once
/// \file
/// The least memory that a training needs, known before it starts. Each Gaussian needs its parameters, their gradients
/// and Adam's two moments, 16 bytes a float, and a step's records of it. They are allocated at the start for the
/// largest number of Gaussians. Ranks share them in whole blocks (comm/row_owners.hpp). Lists, images, the hit buffer
/// and rows of other ranks come on top: they depend on the views. A step without room for the hit buffer computes with
/// less.
///
/// Errors: out_of_memory, in bytes, before anything is allocated; invalid_argument for more Gaussians than a rank can
/// number.

#include <gart/comm/communicator.hpp>
#include <gart/comm/row_owners.hpp>
#include <gart/core/error.hpp>
#include <gart/io/dataset.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/shard/row_selection.hpp>
#include <gart/train/densify/error_growth.hpp>
#include <gart/train/options.hpp>

#include <algorithm>
#include <string>

namespace gart { inline namespace GART_ISA {

/// The largest number of Gaussians of a run that starts with `start`.
inline u64 gaussians_at_end(train_options const& options, dataset const& data, u64 start) {
  switch (options.densify) {
    case densify_kind::error:
      return std::max<u64>(start, growth_budget(options.error, options.max_gaussians, data.training_pixels()));
    case densify_kind::mcmc:
      return std::max<u64>(start, options.max_gaussians);
    default:  // stays as it is, or grows by an unknown number
      return start;
  }
}

/// The Gaussians of the first rank, which has the most.
inline row_owners owners_of(train_options const& options, int ranks) { return {ranks, 0, options.shard_block}; }

/// Bytes of a Gaussian on its rank, one of `ranks`.
inline u64 bytes_of_gaussian(train_options const& options, int sh_degree, int ranks) {
  u64 const parameters = 11 + 3 * static_cast<u64>(sh_degree + 1) * static_cast<u64>(sh_degree + 1);
  int const views = std::min(options.batch, ranks);   // views of a round
  bool const finishes = ranks == 1 || views < ranks;  // ranks that trace whole views also finish gradients
  u64 bytes = 16 * parameters;
  if (finishes) bytes += sizeof(ray_gaussian) + moment_stride * sizeof(float);  // its record and its moments in a view
  if (options.dropout > 0) bytes += sizeof(float);                              // the opacity that a step shows
  // The narrowest filter; three filtered sizes and an opacity, once to send and once to finish.
  if (options.render.antialias > 0) bytes += sizeof(float) * (finishes && ranks > 1 ? 9 : 5);
  if (ranks > 1) bytes += detail::exchange_bytes_of_row(views, ranks);
  return bytes;
}

/// Bytes of the largest share, for so many Gaussians on `ranks` ranks.
inline u64 least_bytes(train_options const& options, u64 gaussians, int sh_degree, int ranks) {
  return bytes_of_gaussian(options, sh_degree, ranks) * owners_of(options, ranks).owned(gaussians);
}

/// Throws where the policy has less memory than that, after its share for other ranks on the same device.
template <execution E, class Comm>
void require_room(E& exec, Comm& comm, train_options const& options, dataset const& data, int sh_degree, u64 start) {
  u64 const free = exec.free_bytes() / static_cast<u64>(comm.sharers()),
            gaussians = gaussians_at_end(options, data, start);
  if (owners_of(options, comm.size()).owned(gaussians) > most_gaussians)
    throw invalid_argument("train_options.max_gaussians: " + std::to_string(gaussians) + " Gaussians on " +
                           std::to_string(comm.size()) + (comm.size() == 1 ? " rank" : " ranks") +
                           " are more than the " + std::to_string(most_gaussians) +
                           " that a rank can hold; lower it, or take more ranks");
  u64 const need = least_bytes(options, gaussians, sh_degree, comm.size());
  if (free == 0 || need <= free) return;
  u64 const fit = free / (need / std::max<u64>(gaussians, 1) + 1);
  throw out_of_memory(E::device ? "CUDA device" : "host", need, free,
                      std::to_string(gaussians) + " Gaussians of degree " + std::to_string(sh_degree) + " on " +
                          std::to_string(comm.size()) + (comm.size() == 1 ? " rank" : " ranks") +
                          " need that much at the least; lower train_options.max_gaussians to less than " +
                          std::to_string(fit) + ", or the degree, or take more ranks");
}

}}  // namespace gart::GART_ISA
