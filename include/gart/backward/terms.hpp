#pragma once
// The two parts of a hit's gradient, and which of them a pass computes: colour (3 K floats of SH) and geometry (10
// moments).

#include <gart/core/isa.hpp>

#include <type_traits>

namespace gart::inline GART_ISA {

struct color {};
struct geometry {};

template <class... T>
struct terms {
  static constexpr bool color = (std::is_same_v<T, gart::color> || ...);
  static constexpr bool geometry = (std::is_same_v<T, gart::geometry> || ...);
  static constexpr bool any = color || geometry;
};

}  // namespace gart::inline GART_ISA
