#pragma once
// A backward strategy is a composition: what the forward pass records of a hit, which terms are gathered by
// primitive and which are scattered by pixel.

#include <gart/backward/record_lt.hpp>
#include <gart/backward/terms.hpp>

namespace gart::inline GART_ISA {

// Nothing recorded; every ray is traced again and scatters.
struct pixel_strategy {
  static constexpr char const* name = "pixel";
  static constexpr bool ordered = false;  // sums in a fixed order: the same bits in every run
  template <int Size>
  using record = record_none;
  using gather = terms<>;
  using scatter = terms<color, geometry>;
};

// How a slot of the LT buffer that no hit wrote is told from one that is a hit: `cleared`, the buffer holds NaN before
// every forward pass; `recomputed`, each pixel of a box is evaluated again, by the same function, and held against the
// last hit of its ray: the same decision, bit for bit, with nothing to clear. It measured better on a device and on a
// host (docs/backward.md).
enum class slot_validity { cleared, recomputed };

// One channel: the colour gradient of a hit needs only its weight. Geometry by pixel.
struct hybrid_strategy {
  static constexpr char const* name = "hybrid";
  static constexpr bool ordered = false, lane_by_lane = false;
  static constexpr slot_validity validity = slot_validity::cleared;
  template <int Size>
  using record = record_lt<weight_entry, Size>;
  using gather = terms<color>;
  using scatter = terms<geometry>;
  using fallback = pixel_strategy;  // where that has no room either: it needs none
};

// Four channels; no ray is traced twice.
struct primitive_strategy {
  static constexpr char const* name = "primitive";
  static constexpr bool ordered = false, lane_by_lane = false;
  static constexpr slot_validity validity = slot_validity::recomputed;
  template <int Size>
  using record = record_lt<lt_entry, Size>;
  using gather = terms<color, geometry>;
  using scatter = terms<>;
  using fallback = hybrid_strategy;  // where the LT buffer has no room: a quarter of it
};

// The primitive strategy with slots of another format (backward/lt_slot.hpp): less memory for less exact gradients.
template <class Entry>
struct primitive_strategy_in : primitive_strategy {
  template <int Size>
  using record = record_lt<Entry, Size>;
};

// The primitive strategy with its sums in a fixed order.
struct deterministic_strategy : primitive_strategy {
  static constexpr char const* name = "deterministic";
  static constexpr bool ordered = true;
};

// The primitive strategy with the other rule: what recomputing is tested and measured against.
struct cleared_strategy : primitive_strategy {
  static constexpr char const* name = "cleared";
  static constexpr slot_validity validity = slot_validity::cleared;
};

// The primitive strategy by the plain gather (backward/gather.hpp): what packets and matrix units are tested and
// measured against.
struct lane_strategy : primitive_strategy {
  static constexpr char const* name = "lane";
  static constexpr bool lane_by_lane = true;
};

}  // namespace gart::inline GART_ISA
