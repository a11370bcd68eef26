#pragma once
/// \file
/// The two parts of a hit's gradient: colour (3 K floats of SH) and geometry (10 moments). A pass computes one or both.
/// Geometry is of the image's colour alone, or of its depth too.

#include <gart/core/isa.hpp>

#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// Names of the terms.
namespace term {
/// The 3 K floats of SH.
struct color {};
/// The 10 moments.
struct geometry {};
/// The part of geometry's gradient that the image's depth adds.
struct depth {};
}  // namespace term

/// Which of them a pass computes.
template <class... T>
struct terms {
  static constexpr bool color = (std::is_same_v<T, term::color> || ...);        ///< whether colour is one of them
  static constexpr bool geometry = (std::is_same_v<T, term::geometry> || ...);  ///< whether geometry is one of them
  static constexpr bool depth = (std::is_same_v<T, term::depth> || ...);        ///< whether geometry is of depth too
  static constexpr bool any = color || geometry;                                ///< whether there is one
  static_assert(geometry || !depth, "the gradient of depth is one of geometry");
  /// The same, its geometry of depth too.
  using with_depth = std::conditional_t<geometry, terms<T..., term::depth>, terms>;
};

}}  // namespace gart::GART_ISA
