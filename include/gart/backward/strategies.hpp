#pragma once
/// \file
/// The backward strategies, and the one list of them: the program, the benchmarks and the tests take them from here.

#include <gart/backward/depth.hpp>
#include <gart/backward/record_slots.hpp>
#include <gart/backward/strategy.hpp>

#include <array>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Nothing recorded; every ray is traced again and scatters.
struct pixel_strategy : strategy_base {
  static constexpr char const* name = "pixel";  ///< as requests have it
  /// Nothing.
  template <int Size>
  using record = record_none;
  using gather = terms<>;                  ///< nothing
  using scatter = terms<color, geometry>;  ///< all
};

/// One channel: the colour gradient of a hit needs only its weight. Geometry by pixel.
struct hybrid_strategy : strategy_base {
  static constexpr char const* name = "hybrid";  ///< as requests have it
  /// The weight.
  template <int Size>
  using record = record_slots<weight_entry, Size>;
  using gather = terms<color>;      ///< by primitive
  using scatter = terms<geometry>;  ///< by pixel
  using fallback = pixel_strategy;  ///< it needs no room
};

/// Four channels; no ray is traced twice.
struct primitive_strategy : strategy_base {
  static constexpr char const* name = "primitive";                      ///< as requests have it
  static constexpr slot_validity validity = slot_validity::recomputed;  ///< nothing is cleared
  /// V and the weight.
  template <int Size>
  using record = record_slots<hit_entry, Size>;
  using gather = terms<color, geometry>;  ///< all
  using scatter = terms<>;                ///< nothing
  using fallback = hybrid_strategy;       ///< a quarter of the room
};

/// The primitive strategy with slots of another format (backward/hit_slot.hpp): less memory for less exact gradients.
template <class Entry>
struct primitive_strategy_in : primitive_strategy {
  /// Of that format.
  template <int Size>
  using record = record_slots<Entry, Size>;
};

/// The primitive strategy with its sums in a fixed order.
struct deterministic_strategy : primitive_strategy {
  static constexpr char const* name = "deterministic";  ///< as requests have it
  static constexpr bool ordered = true;                 ///< by a second launch
};

/// A strategy whose gradient is of the image's depth too, and of its transmittance (backward/depth.hpp): a float a slot
/// more, where geometry is gathered.
template <class Strategy>
struct with_depth : Strategy {
  /// With the depth beside each slot.
  template <int Size>
  using record =
      std::conditional_t<Strategy::gather::geometry, record_with_depth<typename Strategy::template record<Size>>,
                         typename Strategy::template record<Size>>;
  using gather = typename Strategy::gather::with_depth;    ///< its geometry of depth too
  using scatter = typename Strategy::scatter::with_depth;  ///< its geometry of depth too
  /// With depth too.
  using fallback =
      std::conditional_t<std::is_void_v<typename Strategy::fallback>, void, with_depth<typename Strategy::fallback>>;
};
/// Whether a strategy's gradient is of depth too.
template <strategy Strategy>
inline constexpr bool has_depth = Strategy::gather::depth || Strategy::scatter::depth;

/// Strategies by their names.
template <strategy... S>
struct strategy_list {
  static constexpr std::array<char const*, sizeof...(S)> names{S::name...};  ///< in the list's order

  /// f(S{}) for each, in order.
  template <class F>
  static void for_each(F&& f) {
    (f(S{}), ...);
  }
  /// f(S{}) for the one of that name. False where there is none.
  template <class F>
  static bool with(std::string_view name, F&& f) {
    return ((name == S::name && (f(S{}), true)) || ...);
  }
};

/// In the order of preference, the best last.
using strategies = strategy_list<pixel_strategy, hybrid_strategy, deterministic_strategy, primitive_strategy>;

/// Their names, in that order.
inline std::vector<std::string> strategy_names() { return {strategies::names.begin(), strategies::names.end()}; }

static_assert(strategy<primitive_strategy_in<half_hit_entry>>);

}}  // namespace gart::GART_ISA
