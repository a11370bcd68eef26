#pragma once
/// \file
/// Whether Gaussians have changed, by one number of all their parameters. Arrays that somebody else writes to tell
/// nobody when they change. A sum over them does. It costs one read where a tree over them costs tens.

#include <gart/algorithm/reduce.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/math/arith.hpp>
#include <gart/scene/gaussians.hpp>

namespace gart { inline namespace GART_ISA {

namespace ray_kernels {

struct print_gaussian {
  gaussians_view<float const> scene;
  u64* prints;
  GART_KERNEL void operator()(index_t i) const {
    u64 print = (i + u64{1}) * 0x9e3779b97f4a7c15u;
    for_each_array(
        [&](parameter_array const& a, float const* values) {
          index_t const width = a.width(scene.sh_degree);
          float const* const own = values + static_cast<std::size_t>(width) * i;
          for (index_t k = 0; k < width; ++k)
            print = (print ^ float_to_bits(own[k])) * 0xff51afd7ed558ccdu, print ^= print >> 29;
        },
        scene);
    prints[i] = print;
  }
};

}  // namespace ray_kernels

/// The numbers of the Gaussians that it was asked about, and the memory for one.
template <execution E>
class fingerprint {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit fingerprint(E& exec) : prints_(exec), sum_(exec) {}

  /// Of these; equal for equal parameters, and for others with a chance of 2^-64. Waits for the policy.
  u64 of(E& exec, gaussians_view<float const> scene) {
    if (scene.count == 0) return 0;
    prints_.resize(scene.count), sum_.resize(1);
    parallel_for(exec, "rays/print", scene.count, ray_kernels::print_gaussian{scene, prints_.data()});
    reduce(exec, span<u64 const>(prints_), sum_.view(), reduction::sum);
    return sum_.front();
  }

 private:
  buffer<u64, E> prints_, sum_;
};

}}  // namespace gart::GART_ISA
