#pragma once
/// \file
/// What a trainer on several ranks has beside that of one: the exchange of rows, and the sums of a batch of views.
/// trainer_ranks_impl.hpp has the step. With self_comm there is nothing of it.

#include <gart/exposure/exposure.hpp>
#include <gart/exposure/vignetting.hpp>
#include <gart/lens/differentiate_lens.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/shard/row_exchange.hpp>
#include <gart/shard/sharded_rows.hpp>

#include <array>
#include <optional>
#include <utility>

namespace gart::inline GART_ISA {

/// Of a trainer by itself: nothing.
struct no_shards {
  /// Takes what the other does.
  template <class... T>
  explicit no_shards(T&&...) {}
};

/// What was found of one of a step's images, by the ranks that traced it.
struct image_result {
  std::size_t view = 0;                    ///< of the training views
  float loss = 0, mean_square = 0;         ///< of the whole image
  float by_exposure[exposure::floats]{};   ///< the loss by the view's exposure, where that is learned
  float by_falloff[vignetting::floats]{};  ///< the loss by its lens's falloff, where that is learned
  std::array<double, 36> metric{};         ///< of its pose (pose/pose_metric.hpp), where that was asked for
  pose_gradient by_pose;                   ///< the loss by it, where that is learned
  float by_lens[lens_gradient::floats]{};  ///< the loss by the lens, where that is learned
};

/// Gradients of colours that are in no memory but as ranks have sent them (shard/row_exchange.hpp).
struct arrived_colors {
  int views = 0;      ///< of the step's last round
  float share = 1;    ///< as row_exchange::sum_colors has it
  bool adds = false;  ///< to those of the rounds before
};

/// Comm: a communicator for E.
template <execution E, class Comm, class Traits, class Tracer>
struct shards {
  using response = typename Traits::response;          ///< of the Gaussians
  static constexpr int sh_degree = Traits::sh_degree;  ///< of the coefficients that are stored
  using exchange = row_exchange<E, Comm, Tracer::tile_size, sh_degree, response>;  ///< of this tracer's tiles

  sharded_rows<E, Comm> rows;             ///< who has which
  exchange round;                         ///< of the views under way
  sharded_rows<E, Comm> pose_runs;        ///< who has which sums of a pose's gradient
  antialiased<E> filter;                  ///< of this rank's rows
  buffer<ray_gaussian, E> prepared;       ///< this rank's rows in a view's frame
  gaussians<E> view_gradients,            ///< of this rank's rows, by one view of a batch
      unit_gradients;                     ///< what this rank has summed of its unit: .sh, and of a whole view all
  buffer<float, E> moments;               ///< of this rank's rows, by one view
  span<float const> by_exposure,          ///< what its exposure makes of the loss of the image that was traced last,
      by_falloff;                         ///< and its lens's falloff
  bool loss_by_strips = false;            ///< each rank has differentiated that of its own
  u64 sent = 0;                           ///< bytes to other ranks since the run began
  std::optional<arrived_colors> arrived;  ///< of the last step, where Adam took them as they came

  /// `block`: Gaussians that stay together.
  shards(E& exec, Comm const& comm, index_t block)
      : rows(exec, comm, block),
        round(exec, comm, block),
        pose_runs(exec, comm, std::max<index_t>(block / pose_differentiation<E>::run, 1)),
        filter(exec),
        prepared(exec),
        view_gradients(exec, 0, sh_degree),
        unit_gradients(exec, 0, sh_degree),
        moments(exec) {}
};

}  // namespace gart::inline GART_ISA
