#pragma once
/// \file
/// The densifiers of the library, by the names of train_options.densify. A new one is a header and a line here. One
/// that grows to a known number also has a line in gaussians_at_end (train/memory_need.hpp).

#include <gart/train/densify/adc.hpp>
#include <gart/train/densify/error_growth.hpp>
#include <gart/train/densify/mcmc.hpp>

#include <memory>

namespace gart { inline namespace GART_ISA {

/// That of a run.
template <execution E>
std::unique_ptr<densifier<E>> make_densifier(E& exec, density_setup const& run) {
  switch (run.options.densify) {
    case densify_kind::error:
      return std::make_unique<error_growth<E>>(exec, run);
    case densify_kind::mcmc:
      return std::make_unique<mcmc<E>>(exec, run);
    case densify_kind::adc:
      return std::make_unique<adaptive_density<E>>(exec, run);
    case densify_kind::none:
      break;
  }
  return std::make_unique<densifier<E>>();
}

}}  // namespace gart::GART_ISA
