#pragma once
// The bytes of a GLB file, from its JSON and its binary chunk.

#include <gart/core/types.hpp>

#include <cstring>
#include <string>

namespace gart_test {

inline std::string glb_of(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' '), binary.resize((binary.size() + 3) / 4 * 4, '\0');
  std::string out;
  auto const add = [&](std::size_t v) {
    char raw[4];
    gart::u32 const word = static_cast<gart::u32>(v);
    std::memcpy(raw, &word, 4);
    out.append(raw, 4);
  };
  for (std::size_t v : {std::size_t{0x46546c67}, std::size_t{2}, 28 + json.size() + binary.size(), json.size(),
                        std::size_t{0x4e4f534a}})
    add(v);
  out += json;
  add(binary.size()), add(0x004e4942);
  return out + binary;
}

}  // namespace gart_test
