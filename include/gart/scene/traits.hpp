#pragma once
// What a scene requires, at compile time. Kernels choose code by it, so that what a scene does not need has no
// registers, no fields and no bytes. The rows that gart's libraries compile are SH degrees 0 to 3 (train/rows.hpp).

namespace gart {

template <int ShDegree = 3>
struct scene_traits {
  static_assert(ShDegree >= 0 && ShDegree <= 3, "spherical harmonics go to degree 3");
  static constexpr int sh_degree = ShDegree;
};

}  // namespace gart
