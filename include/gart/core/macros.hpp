#pragma once
/// \file
/// Annotations that let one body compile for the host and for a CUDA device. GART_HD marks a function for both.
/// GART_INLINE forces inlining: the code that decides a hit is compiled into every kernel from one source.

#include <gart/core/isa.hpp>

#if defined(__CUDACC__)
#define GART_HD __host__ __device__
#define GART_INLINE __forceinline__
#else
/// Both hosts and devices may call it.
#define GART_HD
/// Inlined, whatever the compiler would choose.
#define GART_INLINE inline __attribute__((always_inline))
#endif

// The body of a kernel, and the functions of its policy that it calls. Instantiated for one policy, it calls only that
// policy's functions. nvcc cannot see that from a template, and would warn. It stands right before the declaration, not
// behind `template <...>`: a tile kernel takes `auto const& team`.
#if defined(__CUDACC__)
#define GART_KERNEL _Pragma("nv_exec_check_disable") __host__ __device__
#else
/// A body of a kernel.
#define GART_KERNEL
#endif

#if defined(__CUDA_ARCH__)
#define GART_UNROLL _Pragma("unroll")
#define GART_NO_UNROLL _Pragma("unroll 1")
#else
/// Before a loop: unrolled on a device.
#define GART_UNROLL
/// Before a loop: a device does not change it.
#define GART_NO_UNROLL
#endif
