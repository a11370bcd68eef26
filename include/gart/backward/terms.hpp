#pragma once
/// \file
/// The two parts of a hit's gradient, and which of them a pass computes: colour (3 K floats of SH) and geometry (10
/// moments).

#include <gart/core/isa.hpp>

#include <type_traits>

namespace gart::inline GART_ISA {

/// Stands for the 3 K floats of SH.
struct color {};
/// Stands for the 10 moments.
struct geometry {};

/// Which of the two a pass computes.
template <class... T>
struct terms {
  static constexpr bool color = (std::is_same_v<T, gart::color> || ...);        ///< whether colour is one of them
  static constexpr bool geometry = (std::is_same_v<T, gart::geometry> || ...);  ///< whether geometry is one of them
  static constexpr bool any = color || geometry;                                ///< whether there is one
};

}  // namespace gart::inline GART_ISA
