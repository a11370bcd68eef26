#pragma once
/// \file
/// The integer types of every index and count. Rays, Gaussians and tiles count in 32 bits; anything that is a product
/// of two of them (pairs, LT slots, bytes) counts in 64.

#include <cstddef>
#include <cstdint>

namespace gart {

using u8 = std::uint8_t;
using u16 = std::uint16_t;
using u32 = std::uint32_t;
using u64 = std::uint64_t;
using index_t = std::uint32_t;

/// 16 bytes, moved as one: what wide loads and stores are made of.
struct alignas(16) quad {
  float v[4];
};

}  // namespace gart
