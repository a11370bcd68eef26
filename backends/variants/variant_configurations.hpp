#pragma once
// Which variants there are, for any policy: tile lists, SH degree 3. They lie below 0 in rank, so that only what asks
// for one gets it.

#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace gart {

template <execution E, class Response, class Method = primitive_method>
void register_variant(bool (*available)(std::string*)) {
  constexpr int rank = E::device ? -1 : -2;
  register_configuration_of<E, scene_traits<3, Response>, tile_tracer<E, 8, Response>, Method>(rank, available);
}

// Kernel degree 4, and a hit buffer of half the memory.
template <execution E>
void register_variants(bool (*available)(std::string*) = always_available) {
  register_variant<E, generalized_gaussian<4>>(available);
  register_variant<E, generalized_gaussian<>, primitive_method_in<half_hit_entry>>(available);
}

}  // namespace gart
