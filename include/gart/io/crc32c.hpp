#pragma once
/// \file
/// CRC-32C (Castagnoli), the checksum of iSCSI and ext4. It has the reflected polynomial 0x82f63b78, all bits set
/// before and inverted after (RFC 3720, B.4). "123456789" gives 0xe3069283. Eight bytes at a time by eight tables,
/// about a byte a clock cycle on any machine. Finds every change of up to 32 neighbouring bits.

#include <gart/core/types.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace gart {

namespace detail {

// crc_tables[k][b]: byte b with k bytes of zero after it.
inline constexpr auto crc_tables = [] {
  std::array<std::array<u32, 256>, 8> table{};
  for (u32 b = 0; b < 256; ++b) {
    u32 crc = b;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0x82f63b78u : 0u);
    table[0][b] = crc;
  }
  for (std::size_t k = 1; k < 8; ++k)
    for (std::size_t b = 0; b < 256; ++b) table[k][b] = (table[k - 1][b] >> 8) ^ table[0][table[k - 1][b] & 255];
  return table;
}();

}  // namespace detail

/// Of `size` bytes; `before` is the checksum of the bytes before them, to continue.
inline u32 crc32c(void const* data, std::size_t size, u32 before = 0) {
  static_assert(std::endian::native == std::endian::little, "the lowest byte of a word is the first");
  auto const& table = detail::crc_tables;
  auto const* bytes = static_cast<unsigned char const*>(data);
  u32 crc = ~before;
  for (; size >= 8; bytes += 8, size -= 8) {
    u64 word;
    std::memcpy(&word, bytes, sizeof word);
    word ^= crc;
    crc = 0;
    for (std::size_t k = 0; k < 8; ++k) crc ^= table[7 - k][(word >> (8 * k)) & 255];
  }
  for (; size > 0; ++bytes, --size) crc = (crc >> 8) ^ table[0][(crc ^ *bytes) & 255];
  return ~crc;
}

namespace detail {

// The product of two polynomials modulo that of the checksum; the highest bit is the coefficient of x^0.
constexpr u32 crc_product(u32 a, u32 b) {
  u32 product = 0;
  for (; a != 0; a <<= 1) {
    if ((a & 0x80000000u) != 0) product ^= b;
    b = (b >> 1) ^ ((b & 1) != 0 ? 0x82f63b78u : 0u);
  }
  return product;
}

}  // namespace detail

/// The part of a checksum from bytes that `after` others follow. The checksum of A and B together is crc32c_before(crc
/// of A, bytes of B) ^ crc of B. So parts can be summed separately, in any order. Cost: the logarithm of `after`.
constexpr u32 crc32c_before(u32 crc, u64 after) {
  for (u32 step = 0x00800000u; after != 0; after >>= 1, step = detail::crc_product(step, step))  // x^8
    if ((after & 1) != 0) crc = detail::crc_product(step, crc);
  return crc;
}

}  // namespace gart
