#pragma once
/// \file
/// Some rows of an image: those that one of several ranks traces, or all.

#include <gart/core/macros.hpp>

namespace gart {

/// Rows [first, end); all, unless it says otherwise. No image has more than 65,535.
struct image_rows {
  static constexpr int most = 65536;  ///< more than there are
  int first = 0, end = most;          ///< rows of pixels

  /// Whether there is none.
  GART_HD constexpr bool empty() const { return first >= end; }
  /// How many there are.
  GART_HD constexpr int count() const { return empty() ? 0 : end - first; }
  /// Whether row y is one of them.
  GART_HD constexpr bool contains(int y) const { return y >= first && y < end; }
};

}  // namespace gart
