#pragma once
/// \file
/// Coefficients of spherical harmonics between rows of different degrees, in a policy's memory. Cost: a launch.

#include <gart/exec/concepts.hpp>
#include <gart/scene/parameter_table.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct copy_bands_kernel {
  float const* from;
  float* to;
  int from_width, to_width;  // floats of a row
  GART_KERNEL void operator()(index_t i) const {
    float const* const row = from + static_cast<std::size_t>(from_width) * i;
    float* const out = to + static_cast<std::size_t>(to_width) * i;
    for (int k = 0; k < to_width; ++k) out[k] = k < from_width ? row[k] : 0.0f;
  }
};

}  // namespace detail

/// From [count] rows of a degree to rows of another. Bands that `from` has not become zero.
template <execution E>
void copy_bands(E& exec, float const* from, int from_degree, float* to, int to_degree, index_t count) {
  parallel_for(exec, "copy_bands", count,
               detail::copy_bands_kernel{from, to, 3 * sh_coefficients(from_degree), 3 * sh_coefficients(to_degree)});
}

}}  // namespace gart::GART_ISA
