#pragma once
/// \file
/// The requirements of a scene at compile time. Kernels choose code by it. Features that a scene does not need take no
/// registers, no fields and no bytes. The rows that gart's libraries compile are listed by `gart info`;
/// runtime/registry.hpp is how a program compiles its own (examples/5_own_configuration).

#include <gart/math/response.hpp>

namespace gart { inline namespace GART_ISA {

/// What traits must have.
template <class T>
concept scene_requirements = response_function<typename T::response> &&  // how it falls off (math/response.hpp)
    requires {
  // 0 to 3, that the coefficients are stored with
  { T::sh_degree } -> std::convertible_to<int>;
};

/// Response: how a Gaussian falls from its centre (math/response.hpp).
template <int ShDegree = 3, response_function Response = generalized_gaussian<>>
struct scene_traits {
  static_assert(ShDegree >= 0 && ShDegree <= 3, "spherical harmonics go to degree 3");
  static constexpr int sh_degree = ShDegree;  ///< that coefficients are stored with, 0 to 3
  using response = Response;                  ///< its fall-off
};
static_assert(scene_requirements<scene_traits<>>);

}}  // namespace gart::GART_ISA
