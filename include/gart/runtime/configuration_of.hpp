#pragma once
/// \file
/// What templates are as a configuration, and the policy that a request asks for.

#include <gart/backward/gradient_methods.hpp>
#include <gart/comm/self_comm.hpp>
#include <gart/core/isa.hpp>
#include <gart/exec/concepts.hpp>
#include <gart/runtime/request.hpp>

#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// The templates' arguments at run time, for a model of a degree up to theirs.
template <execution E, class Traits, class Tracer, gradient_method Method, class Comm = self_comm>
configuration_info configuration_of(int sh_degree = Traits::sh_degree) {
  using response = typename Traits::response;
  configuration_info configuration;
  configuration.backend = from_string(E::name, backend_kind::automatic);
  configuration.tracer = from_string(Tracer::name, tracer_kind::own);
  configuration.backward = Method::name;
  configuration.sh_degree = sh_degree, configuration.stored_degree = Traits::sh_degree;
  configuration.kernel_degree = response::degree;
  configuration.hit_format =
      from_string(Method::template record<Tracer::tile_size>::entry::name, hit_format_kind::none);
  configuration.depth = has_depth<Method>;
  configuration.ranks = !Comm::alone;
  if constexpr (!E::device) configuration.instruction_set = instruction_set;
  return configuration;
}

/// The policy that a request asks for; of ranks with a device each, on that of this rank.
template <execution E, class Comm = self_comm>
E policy_of(configuration_request const& request) {
  if constexpr (requires(decltype(*request.ranks) ranks) { Comm::device_of(ranks); })
    return E(Comm::device_of(*request.ranks));
  else if constexpr (E::device)
    return E(request.device, request.stream);
  else if constexpr (std::is_constructible_v<E, int>)
    return E(request.threads);
  else
    return E();
}

/// The communicator that a request asks for.
template <class Comm>
Comm comm_of(configuration_request const& request) {
  if constexpr (Comm::alone)
    return Comm();
  else if constexpr (requires(decltype(*request.ranks) ranks) { Comm::device_of(ranks); })
    return Comm(*request.ranks, Comm::device_of(*request.ranks));
  else
    return *request.ranks;
}

}}  // namespace gart::GART_ISA
