#pragma once
/// \file
/// GART_ISA: the inline namespace of everything that depends on a host translation unit's instruction set by layout,
/// bits or code. -march decides the number of lanes (math/lanes.hpp), and whether a*b + c is one rounding
/// (math/arith.hpp). nvcc's host compiler has no lanes. Objects of one program may differ in these. They would share
/// inline functions, templates and types of one name, and all would use one object's. With the instruction set in the
/// name each has its own. The name says too where an object is not optimised (-O0), since a linker that kept the slow
/// code of a program would make an optimised library slow. nvcc's names do not: its two compilers must agree on them.
///
///   namespace gart { inline namespace GART_ISA {   // formulas, kernels, host policies, tracers, trainers
///   namespace gart {                    // what the compiled libraries define and take, and link by
///
/// In the second lie sessions, renderers, data sets, cameras, models, options, errors, files and cuda_exec
/// (cmake/interface.txt has the headers). Their layout is the same everywhere, and an inline function there that needs
/// fma or lanes is forced inline. tests/package links objects and libraries of different instruction sets.
///
/// The name also has gart's version, so objects of two versions do not share its contents. The compiled libraries of
/// two versions are in one process as shared objects: their symbols carry the version (backends/CMakeLists.txt).

#include <gart/core/version.hpp>

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && defined(__FMA__) && defined(__BMI2__)
#define GART_LANES_AVX512 1
#endif

#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define GART_FUSED 1
#endif

#if defined(__CUDACC__) && defined(GART_FUSED)
#define GART_INSTRUCTION_SET nvcc_fma
#elif defined(__CUDACC__)
#define GART_INSTRUCTION_SET nvcc
#elif defined(GART_LANES_AVX512)
#define GART_INSTRUCTION_SET avx512
#elif defined(__AVX2__) && defined(GART_FUSED)
#define GART_INSTRUCTION_SET avx2_fma
#elif defined(__AVX2__)
#define GART_INSTRUCTION_SET avx2
#elif defined(GART_FUSED)
#define GART_INSTRUCTION_SET fma
#else
/// The instruction set that this file is compiled for.
#define GART_INSTRUCTION_SET base
#endif

#if defined(__OPTIMIZE__) || defined(__CUDACC__)
#define GART_UNOPTIMISED
#else
/// Follows the instruction set in names, where the compiler does not optimise.
#define GART_UNOPTIMISED _unoptimised
#endif

///@{
/// The inline namespace's name, as v0_1_avx2_fma.
#define GART_ISA_PASTED(major, minor, set, unoptimised) v##major##_##minor##_##set##unoptimised
#define GART_ISA_OF(major, minor, set, unoptimised) GART_ISA_PASTED(major, minor, set, unoptimised)
#define GART_ISA GART_ISA_OF(GART_VERSION_MAJOR, GART_VERSION_MINOR, GART_INSTRUCTION_SET, GART_UNOPTIMISED)
///@}

/// As they stand; undefined below.
#define GART_TEXT_OF(...) #__VA_ARGS__
/// The macro's value, as text; undefined below.
#define GART_TEXT(macro) GART_TEXT_OF(macro)

namespace gart { inline namespace GART_ISA {

/// "avx2_fma", or "avx2_fma_unoptimised".
inline constexpr char const* instruction_set = GART_TEXT(GART_INSTRUCTION_SET) GART_TEXT(GART_UNOPTIMISED);

}}  // namespace gart::GART_ISA

#undef GART_TEXT
#undef GART_TEXT_OF
