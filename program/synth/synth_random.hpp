#pragma once
// Random numbers of `gart synth` depend only on their indices. So images are the same for any number of threads. They
// are an integer hash, and Owen-scrambled Sobol pairs (B. Burley, "Practical Hash-based Owen Scrambling", JCGT 2020).

#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>

namespace gart_cli {

using gart::u32;
using gart::u64;

// The finalizer of SplitMix64.
inline u64 hash(u64 x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

inline u64 hash(u64 a, u64 b) { return hash(a ^ hash(b)); }

inline float unit_float(u32 bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }  // [0, 1)

inline u32 reverse_bits(u32 x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// A nested uniform scramble in base 2 (Laine and Karras 2011). Every bit is flipped by a hash of the bits above it.
inline u32 owen_scramble(u32 x, u32 seed) {
  x = reverse_bits(x);
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return reverse_bits(x);
}

// The second dimension of the Sobol sequence: its generator matrix is Pascal's triangle modulo 2.
inline u32 sobol_second(u32 index) {
  u32 result = 0;
  for (u32 column = 0x80000000u; index != 0; index >>= 1, column ^= column >> 1)
    if (index & 1) result ^= column;
  return result;
}

// The points of one sample, pair after pair; samples of one stream fill every pair's square evenly.
class sample_sequence {
 public:
  static constexpr u32 max_samples = 4096;  // a stream; a power of two

  sample_sequence(u64 stream, u32 index) : stream_(stream), index_(index) {}

  gart::vec2 next() {
    u64 const h = hash(stream_, pair_++);
    u32 const shuffled = owen_scramble(index_, static_cast<u32>(h)) % max_samples;
    u32 const x = owen_scramble(reverse_bits(shuffled), static_cast<u32>(h >> 32));
    u32 const y = owen_scramble(sobol_second(shuffled), static_cast<u32>(hash(h)));
    return {unit_float(x), unit_float(y)};
  }

 private:
  u64 stream_;
  u32 index_;
  u64 pair_ = 0;
};

}  // namespace gart_cli
