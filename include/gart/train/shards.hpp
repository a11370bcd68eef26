#pragma once
/// \file
/// What a trainer on several ranks has beside that of one: the exchange of rows, and the sums of a batch of views.
/// trainer_ranks_impl.hpp has the step. With self_comm there is nothing of it.

#include <gart/shard/row_exchange.hpp>
#include <gart/shard/sharded_rows.hpp>

#include <utility>

namespace gart::inline GART_ISA {

/// Of a trainer by itself: nothing.
struct no_shards {
  /// Takes what the other does.
  template <class... T>
  explicit no_shards(T&&...) {}
};

/// Comm: a communicator for E.
template <execution E, class Comm, class Traits, class Tracer>
struct shards {
  using response = typename Traits::response;          ///< of the Gaussians
  static constexpr int sh_degree = Traits::sh_degree;  ///< of the coefficients that are stored
  using exchange = row_exchange<E, Comm, Tracer::tile_size, sh_degree, response>;  ///< of this tracer's tiles

  sharded_rows<E, Comm> rows;        ///< who has which
  exchange round;                    ///< of the views under way
  antialiased<E> filter;             ///< of this rank's rows
  buffer<ray_gaussian, E> prepared;  ///< this rank's rows in a view's frame
  gaussians<E> view_gradients,       ///< of this rank's rows, by one view of a batch
      unit_gradients;                ///< what this rank has summed of its unit: .sh alone is used
  buffer<float, E> moments;          ///< of this rank's rows, by one view
  u64 sent = 0;                      ///< bytes to other ranks since the run began

  /// `block`: Gaussians that stay together.
  shards(E& exec, Comm const& comm, index_t block)
      : rows(exec, comm, block),
        round(exec, comm, block),
        filter(exec),
        prepared(exec),
        view_gradients(exec, 0, sh_degree),
        unit_gradients(exec, 0, sh_degree),
        moments(exec) {}
};

}  // namespace gart::inline GART_ISA
