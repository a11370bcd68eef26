#pragma once
/// \file
/// The integer types of every index and count. Rays, Gaussians and tiles count in 32 bits. Products of two of them
/// (pairs, hit slots, bytes) count in 64.

#include <cstddef>
#include <cstdint>

namespace gart {

using u8 = std::uint8_t;        ///< 8 bits
using u16 = std::uint16_t;      ///< 16 bits
using u32 = std::uint32_t;      ///< 32 bits
using u64 = std::uint64_t;      ///< 64 bits
using index_t = std::uint32_t;  ///< of rays, Gaussians and tiles

/// 16 bytes, moved as one: what wide loads and stores are made of.
struct alignas(16) quad {
  float v[4];  ///< the words
};

}  // namespace gart
