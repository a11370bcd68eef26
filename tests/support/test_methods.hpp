#pragma once
// The methods that tests hold gart's own against, and the list of both.

#include <gart/backward/gradient_methods.hpp>

namespace gart_test {

// The primitive method with the other rule for slots: NaN in every one before the forward pass.
struct nan_cleared_slots_method : gart::primitive_method {
  static constexpr char const* name = "cleared";
  static constexpr gart::slot_validity validity = gart::slot_validity::cleared;
};

// The primitive method by the plain gather on every policy: packets and matrix units are tested against it.
struct plain_gather_method : gart::primitive_method {
  static constexpr char const* name = "lane";
  static constexpr bool lane_by_lane = true;
};

using gradient_methods =
    gart::gradient_method_list<plain_gather_method, nan_cleared_slots_method, gart::pixel_method, gart::hybrid_method,
                               gart::deterministic_method, gart::primitive_method>;

}  // namespace gart_test
