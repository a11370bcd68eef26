#pragma once
/// \file
/// Products of small matrices by a GPU's matrix units, from floats to floats. A unit takes numbers of 11 significant
/// bits (tf32). A float is the sum of two such, to 2^-20 of it. Of the four products of two such sums the least is left
/// out. So a product is within 2^-19 of itself, as good as one of floats where many are summed.
///
/// A warp multiplies together: with `row` = lane / 4 and `column` = lane % 4, a lane holds
///   a  16 x 8, elements (row, column), (row + 8, column), (row, column + 4), (row + 8, column + 4)
///   b   8 x 8, elements (column, row), (column + 4, row)
///   d  16 x 8, elements (row, 2 column), (row, 2 column + 1), (row + 8, 2 column), (row + 8, 2 column + 1)
/// (PTX ISA, mma.m16n8k8).

#include <gart/math/arith.hpp>

#if defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// A lane's N elements of a matrix.
template <int N>
struct matrix_part {
  struct alignas(4 * N) words {
    u32 v[N];
  };
  words high, low;

  struct number {
    u32 high, low;
    __device__ GART_INLINE explicit number(float x)
        : high(float_to_bits(x) & kept), low(float_to_bits(x - bits_to_float(high)) & kept) {}
  };
  __device__ GART_INLINE void set(int i, float x) {
    number const n(x);
    high.v[i] = n.high, low.v[i] = n.low;
  }

 private:
  static constexpr u32 kept = 0xffffe000u;
};

/// d += a b
__device__ GART_INLINE void multiply_add(float (&d)[4], matrix_part<4> const& a, matrix_part<2> const& b) {
  auto const add = [&](matrix_part<4>::words const& x, matrix_part<2>::words const& y) {
#if defined(__CUDA_ARCH__)
    asm("mma.sync.aligned.m16n8k8.row.col.f32.tf32.tf32.f32 {%0, %1, %2, %3}, {%4, %5, %6, %7}, {%8, %9}, "
        "{%0, %1, %2, %3};"
        : "+f"(d[0]), "+f"(d[1]), "+f"(d[2]), "+f"(d[3])
        : "r"(x.v[0]), "r"(x.v[1]), "r"(x.v[2]), "r"(x.v[3]), "r"(y.v[0]), "r"(y.v[1]));
#endif
  };
  add(a.low, b.high), add(a.high, b.low), add(a.high, b.high);
}

}}  // namespace gart::GART_ISA

#endif
