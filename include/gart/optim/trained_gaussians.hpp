#pragma once
/// \file
/// Gaussians under training: parameters, gradients and Adam's moments, always of the same count. Memory: 16 bytes a
/// float of a Gaussian. Errors: as gaussians<E>.

#include <gart/optim/adam.hpp>
#include <gart/optim/rows.hpp>

#include <algorithm>
#include <array>
#include <utility>

namespace gart { inline namespace GART_ISA {

/// What an optimizer moves, in a policy's memory.
template <execution E>
struct trained_gaussians {
  gaussians<E> model, gradients;  ///< gradients: of the last step
  optimizer_state<E> moments;     ///< Adam's
  int degree;                     ///< the model's; coefficients above it are zero
  index_t total;                  ///< Gaussians of all ranks

  /// Copies a host model, in rows of `stored_degree`, which is the model's or higher. Moments are zero.
  trained_gaussians(E& exec, gaussian_model const& start, int stored_degree)
      : model(exec, 0, stored_degree),
        gradients(exec, model.size(), stored_degree),
        moments(exec, model.size(), stored_degree),
        degree(start.sh_degree),
        total(static_cast<index_t>(start.size())) {
    assign(model, start);
    resize(start.size());
    moments.first.zero(), moments.second.zero();
  }

  /// Gaussians here.
  index_t size() const { return model.size(); }
  /// Existing Gaussians stay; new ones are undefined.
  void resize(std::size_t n) {
    for (gaussians<E>* each : all()) each->resize_keep(n);
  }
  /// Sets all numbers of the rows from `first` on to zero.
  void clear_from(E& exec, index_t first) {
    for (gaussians<E>* each : all())
      for_each_array(
          [&](parameter_array const& a, buffer<float, E>& values) {
            std::size_t const kept = std::min(std::size_t{first} * a.width(each->sh_degree()), values.size());
            exec.zero(values.data() + kept, (values.size() - kept) * sizeof(float));
          },
          *each);
  }
  /// Reserves memory for n Gaussians. Growth up to n then needs no slack, and no second copy of an array.
  void reserve(std::size_t n) {
    for (gaussians<E>* each : all()) each->reserve(n);
  }
  /// Replaces Gaussian g by origin[g], by numbers; the count may change.
  void take(E& exec, all_rows<E>& rows, span<u32 const> origin) {
    index_t const next = rows.here(static_cast<index_t>(origin.size()));
    for (gaussians<E>* each : {&model, &moments.first, &moments.second}) {
      gaussians<E> taken(exec, next, each->sh_degree());
      rows.take(exec, *each, taken, origin);
      *each = std::move(taken);
    }
    gradients.resize_keep(next);
  }
  ///@{
  /// The host's take the place of all, and copies for the host.
  void assign(gaussian_model const& m, gaussian_model const& first, gaussian_model const& second) {
    assign(model, m), assign(moments.first, first), assign(moments.second, second);
    gradients.resize_keep(model.size());
  }
  gaussian_model to_host(gaussians<E> const& of) const { return with_sh_degree(of.to_host(), degree); }
  ///@}

 private:
  static void assign(gaussians<E>& to, gaussian_model const& from) {
    to.sh_degree() == from.sh_degree ? to.assign(from) : to.assign(with_sh_degree(from, to.sh_degree()));
  }
  std::array<gaussians<E>*, 4> all() { return {&model, &gradients, &moments.first, &moments.second}; }
};

}}  // namespace gart::GART_ISA
