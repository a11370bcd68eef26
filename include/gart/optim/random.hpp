#pragma once
/// \file
/// Random numbers without state: Philox4x32-10 (Salmon et al., Parallel Random Numbers: As Easy as 1, 2, 3, SC 2011).
/// A number is a function of (seed, step, use, index). So kernels draw in any order, and checkpoints need no random
/// state. Integers and uniforms have the same bits on every policy. Normals go through log, cos and sin, which policies
/// may round differently. About 40 integer instructions for four words.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// The purpose of a number: draws for different purposes are independent.
enum class random_use : u32 { relocation = 1, growth, noise, split, dropout, user = 0x10000 };

/// 128 random bits.
struct random_words {
  u32 v[4];  ///< 32 bits each
};

/// The words of a counter under a key.
GART_HD inline random_words philox4x32(random_words counter, u32 key0, u32 key1) {
  for (int round = 0; round < 10; ++round) {
    u64 const a = u64{0xD2511F53u} * counter.v[0], b = u64{0xCD9E8D57u} * counter.v[2];
    counter = {{static_cast<u32>(b >> 32) ^ counter.v[1] ^ key0, static_cast<u32>(b),
                static_cast<u32>(a >> 32) ^ counter.v[3] ^ key1, static_cast<u32>(a)}};
    key0 += 0x9E3779B9u, key1 += 0xBB67AE85u;
  }
  return counter;
}

/// Trivially copyable: kernels hold one by value.
struct random_source {
  u64 seed = 0;                       ///< of the run
  u32 step = 0;                       ///< of the training
  random_use use = random_use::user;  ///< purpose

  /// The words of an index.
  GART_HD random_words words(u64 index) const {
    return philox4x32({{static_cast<u32>(index), static_cast<u32>(index >> 32), step, static_cast<u32>(use)}},
                      static_cast<u32>(seed), static_cast<u32>(seed >> 32));
  }
};

/// [0, 1), 24 bits: every value is a float.
GART_HD inline float uniform(u32 word) { return static_cast<float>(word >> 8) * 0x1p-24f; }

/// [0, bound) from two words, by the high half of a 128-bit product; the bias is below bound / 2^64.
GART_HD inline u64 below(u32 high, u32 low, u64 bound) {
  u64 const b_high = bound >> 32, b_low = bound & 0xffffffffu;
  u64 const middle = u64{high} * b_low + ((u64{low} * b_low) >> 32);
  u64 const cross = u64{low} * b_high + (middle & 0xffffffffu);
  return u64{high} * b_high + (middle >> 32) + (cross >> 32);
}

/// Four independent standard normals (Box-Muller); at most 5.77 in size.
struct random_normals {
  float v[4];  ///< the normals
};
/// Of four words.
GART_HD inline random_normals normals(random_words const& words) {
  random_normals out;
  for (int pair = 0; pair < 2; ++pair) {
    float const radius = sqrtf(-2.0f * logf(static_cast<float>((words.v[2 * pair] >> 8) + 1) * 0x1p-24f));
    float const angle = 6.28318531f * uniform(words.v[2 * pair + 1]);
    out.v[2 * pair] = radius * cosf(angle);
    out.v[2 * pair + 1] = radius * sinf(angle);
  }
  return out;
}

}}  // namespace gart::GART_ISA
