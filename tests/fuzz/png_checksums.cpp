// libFuzzer's mutations of a PNG, their checksums set right: libpng would refuse all others before it looks at them.

#include <zlib.h>

#include <cstddef>
#include <cstdint>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t capacity);

namespace {

std::uint32_t big_endian(std::uint8_t const* at) {
  return (std::uint32_t{at[0]} << 24) | (std::uint32_t{at[1]} << 16) | (std::uint32_t{at[2]} << 8) | at[3];
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t capacity,
                                               unsigned int seed) {
  std::size_t const mutated = LLVMFuzzerMutate(data, size, capacity);
  if (seed % 16 == 0) return mutated;
  std::size_t const signature = 8, frame = 12;  // a chunk's length, name and checksum
  for (std::size_t at = signature; mutated >= at + frame;) {
    std::size_t const length = big_endian(data + at);
    if (length > mutated - at - frame) break;
    std::uint32_t const sum = static_cast<std::uint32_t>(crc32(0, data + at + 4, static_cast<unsigned>(length) + 4));
    for (int i = 0; i < 4; ++i) data[at + 8 + length + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
    at += frame + length;
  }
  return mutated;
}
