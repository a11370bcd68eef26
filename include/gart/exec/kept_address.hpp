#pragma once
/// \file
/// Shared memory by an address that the compiler keeps: a block's window, a lane's place in an array. Otherwise it
/// computes the address again at each use. Device only.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

#if defined(__CUDACC__)

namespace gart { inline namespace GART_ISA { namespace detail {

template <class T>
__device__ GART_INLINE T& kept_address(void* shared) {
  u32 address = static_cast<u32>(__cvta_generic_to_shared(shared));
  asm volatile("" : "+r"(address));
  void* const kept = __cvta_shared_to_generic(address);
  __builtin_assume(__isShared(kept));
  return *static_cast<T*>(kept);
}

}}}  // namespace gart::GART_ISA::detail

#endif
