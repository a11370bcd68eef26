#pragma once
/// \file
/// The Gaussians that a training begins with: all, or each rank's own rows (comm/row_owners.hpp). So no rank must hold
/// a model that is too large for it.

#include <gart/scene/gaussians.hpp>

namespace gart {

/// A model to start from, which must outlive it.
struct start_model {
  /// All Gaussians, on every rank.
  start_model(gaussian_model const& whole) : rows(whole) {}
  /// part: this rank's rows, by train_options.shard_block, of a model that all ranks have together.
  start_model(gaussian_model const& mine, bool part) : rows(mine), is_part(part) {}
  gaussian_model const& rows;  ///< what this rank was given
  bool is_part = false;        ///< whether others have more
};

}  // namespace gart
