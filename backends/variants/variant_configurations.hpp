#pragma once
// Which variants there are, for any policy: tile lists, the primitive strategy, SH degree 3. They lie below 0 in rank,
// so that only what asks for one gets it.

#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace gart {

template <execution E, class Response, int TileSize = 8, class Strategy = primitive_strategy>
void register_variant(bool (*available)(std::string*)) {
  constexpr int rank = E::device ? -1 : -2;
  register_configuration_of<E, scene_traits<3, Response>, tile_tracer<E, TileSize, Response>, Strategy>(rank,
                                                                                                        available);
}

// Other responses: the kernel degrees besides 2.
template <execution E>
void register_kernel_variants(bool (*available)(std::string*) = always_available) {
  register_variant<E, generalized_gaussian<1>>(available);
  register_variant<E, generalized_gaussian<3>>(available);
  register_variant<E, generalized_gaussian<4>>(available);
  register_variant<E, generalized_gaussian<5>>(available);
  register_variant<E, generalized_gaussian<8>>(available);
}

// Other shapes of the work and its memory: tiles, slots of the LT buffer.
template <execution E>
void register_shape_variants(bool (*available)(std::string*) = always_available) {
  register_variant<E, generalized_gaussian<>, 4>(available);
  register_variant<E, generalized_gaussian<>, 16>(available);
  register_variant<E, generalized_gaussian<>, 8, primitive_strategy_in<lt_half_entry>>(available);
}

}  // namespace gart
