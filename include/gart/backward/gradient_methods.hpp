#pragma once
/// \file
/// The gradient methods, and the one list of them: the program, the benchmarks and the tests take them from here.

#include <gart/backward/depth.hpp>
#include <gart/backward/gradient_method.hpp>
#include <gart/backward/record_slots.hpp>

#include <array>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Nothing recorded; every ray is traced again and scatters.
struct pixel_method : gradient_method_base {
  static constexpr char const* name = "pixel";  ///< its name in requests
  /// Nothing.
  template <int Size>
  using record = record_none;
  using gather = terms<>;                              ///< nothing
  using scatter = terms<term::color, term::geometry>;  ///< all
};

/// One channel: the colour gradient of a hit needs only its weight. Geometry by pixel.
struct hybrid_method : gradient_method_base {
  static constexpr char const* name = "hybrid";  ///< its name in requests
  /// The weight.
  template <int Size>
  using record = record_slots<weight_entry, Size>;
  using gather = terms<term::color>;      ///< by primitive
  using scatter = terms<term::geometry>;  ///< by pixel
  using fallback = pixel_method;          ///< it needs no room
};

/// Four channels; no ray is traced twice.
struct primitive_method : gradient_method_base {
  static constexpr char const* name = "primitive";                      ///< its name in requests
  static constexpr slot_validity validity = slot_validity::recomputed;  ///< nothing is cleared
  /// V and the weight.
  template <int Size>
  using record = record_slots<hit_entry, Size>;
  using gather = terms<term::color, term::geometry>;  ///< all
  using scatter = terms<>;                            ///< nothing
  using fallback = hybrid_method;                     ///< a quarter of the room
};

/// The primitive method with slots of another format (backward/hit_slot.hpp): less memory for less exact gradients.
template <class Entry>
struct primitive_method_in : primitive_method {
  /// Of that format.
  template <int Size>
  using record = record_slots<Entry, Size>;
};

/// The primitive method with its sums in a fixed order.
struct deterministic_method : primitive_method {
  static constexpr char const* name = "deterministic";  ///< its name in requests
  static constexpr bool ordered = true;                 ///< by a second launch
};

/// A method that also has gradients by the image's depth and transmittance (backward/depth.hpp). Where geometry is
/// gathered it takes a float a slot more.
template <class Method>
struct with_depth : Method {
  /// With the depth beside each slot.
  template <int Size>
  using record = std::conditional_t<Method::gather::geometry, record_with_depth<typename Method::template record<Size>>,
                                    typename Method::template record<Size>>;
  using gather = typename Method::gather::with_depth;    ///< its geometry of depth too
  using scatter = typename Method::scatter::with_depth;  ///< its geometry of depth too
  /// With depth too.
  using fallback =
      std::conditional_t<std::is_void_v<typename Method::fallback>, void, with_depth<typename Method::fallback>>;
};
/// Whether a method's gradient is of depth too.
template <gradient_method Method>
inline constexpr bool has_depth = Method::gather::depth || Method::scatter::depth;

/// Methods by their names.
template <gradient_method... S>
struct gradient_method_list {
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
using gradient_methods = gradient_method_list<pixel_method, hybrid_method, deterministic_method, primitive_method>;

/// Their names, in that order.
inline std::vector<std::string> gradient_method_names() {
  return {gradient_methods::names.begin(), gradient_methods::names.end()};
}

static_assert(gradient_method<primitive_method_in<half_hit_entry>>);

}}  // namespace gart::GART_ISA
