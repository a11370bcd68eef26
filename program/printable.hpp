#pragma once
// Text for a terminal that may have bytes of a file in it.

#include <cstdio>
#include <string>

namespace gart_cli {

// Control characters, which a terminal takes for commands, become \x1b and the like; ends of lines and tabs stay.
inline std::string printable(std::string const& text) {
  std::string out;
  out.reserve(text.size());
  auto const escaped = [&](unsigned char c) {
    char code[8];
    std::snprintf(code, sizeof code, "\\x%02x", static_cast<unsigned>(c));
    out += code;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    auto const c = static_cast<unsigned char>(text[i]);
    bool const second_set = c == 0xc2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) >= 0x80 &&
                            static_cast<unsigned char>(text[i + 1]) < 0xa0;  // in UTF-8
    if (second_set) {
      escaped(c), escaped(static_cast<unsigned char>(text[++i]));
    } else if ((c < 0x20 && c != '\n' && c != '\t') || c == 0x7f) {
      escaped(c);
    } else {
      out += text[i];
    }
  }
  return out;
}

}  // namespace gart_cli
