#pragma once
// Log lines that clients can cause: always plain text, and few a second.

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

namespace gart::view {

// In ASCII without control characters: other bytes as \x1b. At most `most` characters.
inline std::string escaped(std::string_view text, std::size_t most) {
  std::string out;
  for (char const c : text) {
    char code[8] = {c};
    if (c < ' ' || c > '~')
      std::snprintf(code, sizeof code, "\\x%02x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    if (out.size() + std::string_view(code).size() > most) break;
    out += code;
  }
  return out;
}

// Ten lines at once, then one a second; how many were left out is said with the next one.
class log_rate {
 public:
  // What is to be written now; empty: nothing.
  std::string line(std::string text, double seconds_now) {
    room_ = std::min(most, room_ + (seconds_now - last_) / seconds_each);
    last_ = seconds_now;
    if (room_ < 1) return ++left_out_, std::string();
    room_ -= 1;
    if (auto const n = std::exchange(left_out_, 0)) text += " (" + std::to_string(n) + " lines before it are left out)";
    return text;
  }

 private:
  static constexpr double most = 10, seconds_each = 1;
  double room_ = most, last_ = 0;
  std::size_t left_out_ = 0;
};

}  // namespace gart::view
