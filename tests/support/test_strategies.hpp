#pragma once
// The strategies that tests hold gart's own against, and the list of both.

#include <gart/backward/strategies.hpp>

namespace gart_test {

// The primitive strategy with the other rule for slots: NaN in every one before the forward pass.
struct nan_cleared_slots_strategy : gart::primitive_strategy {
  static constexpr char const* name = "cleared";
  static constexpr gart::slot_validity validity = gart::slot_validity::cleared;
};

// The primitive strategy by the plain gather on every policy: packets and matrix units are tested against it.
struct plain_gather_strategy : gart::primitive_strategy {
  static constexpr char const* name = "lane";
  static constexpr bool lane_by_lane = true;
};

using strategies = gart::strategy_list<plain_gather_strategy, nan_cleared_slots_strategy, gart::pixel_strategy,
                                       gart::hybrid_strategy, gart::deterministic_strategy, gart::primitive_strategy>;

}  // namespace gart_test
