#pragma once
// A command's progress on stderr. On a terminal one line is rewritten. Else each tenth of the work, or half minute, has
// a line.

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace gart_cli {

class progress {
 public:
  explicit progress(bool quiet);
  ~progress() { clear(); }
  progress(progress const&) = delete;
  progress& operator=(progress const&) = delete;

  // Whether a state given now would be seen: states cost time to put into words. `share` is the part done, 0 to 1.
  bool due(double share) const;
  void state(std::string const& text, double share);
  // Something that stays on the screen.
  void note(std::string const& text);
  void notes(std::vector<std::string> const& texts);
  void clear();

 private:
  using clock = std::chrono::steady_clock;
  bool quiet_, terminal_, shown_ = false;
  double last_share_ = -1;
  clock::time_point last_time_{};
};

std::string with_commas(std::uint64_t value);   // 1,234,567
std::string as_duration(double seconds);        // 48 s, 3:07, 1:02:03
std::string as_bytes(double bytes);             // 1.4 GB
std::string fixed(double value, int decimals);  // "-" where it is not finite

}  // namespace gart_cli
