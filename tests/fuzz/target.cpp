// libFuzzer's entry, compiled once for each reader.

#include "fuzz/readers.hpp"

#include <cstddef>
#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  gart_fuzz::GART_FUZZ_READER({reinterpret_cast<char const*>(data), size});
  return 0;
}
