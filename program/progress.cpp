#include "progress.hpp"

#include "printable.hpp"

#include <cmath>
#include <cstdio>

#include <sys/ioctl.h>
#include <unistd.h>
#include <algorithm>

namespace gart_cli {

namespace {

std::size_t terminal_width() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

progress::progress(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}

bool progress::due(double share) const {
  if (quiet_) return false;
  if (last_share_ < 0 || share < last_share_) return true;
  double const seconds = std::chrono::duration<double>(clock::now() - last_time_).count();
  if (terminal_) return seconds >= 0.1 || share >= 1;
  // A log has a line each tenth of the work, but none for what takes no time.
  return seconds >= 30 || (seconds >= 1 && share - last_share_ >= 0.1 - 1e-9) || (share >= 1 && last_share_ < 1);
}

void progress::state(std::string const& text, double share) {
  if (!due(share)) return;
  last_share_ = share, last_time_ = clock::now();
  if (terminal_) {
    // A line longer than the screen would wrap, and could then not be rewritten.
    std::fprintf(stderr, "\r\033[K%s", text.substr(0, terminal_width() - 1).c_str());
    std::fflush(stderr);
    shown_ = true;
  } else {
    std::fprintf(stderr, "%s\n", text.c_str());
  }
}

void progress::note(std::string const& text) {
  if (quiet_) return;
  clear();
  std::fprintf(stderr, "%s\n", printable(text).c_str());
}

void progress::notes(std::vector<std::string> const& texts) {
  for (std::string const& text : texts) note(text);
}

void progress::clear() {
  if (!shown_) return;
  std::fputs("\r\033[K", stderr);
  shown_ = false, last_share_ = -1;
}

std::string with_commas(std::uint64_t value) {
  std::string text = std::to_string(value);
  for (int at = static_cast<int>(text.size()) - 3; at > 0; at -= 3) text.insert(static_cast<std::size_t>(at), 1, ',');
  return text;
}

std::string as_duration(double seconds) {
  if (!std::isfinite(seconds)) return "-";
  if (seconds < 60) return fixed(seconds, seconds < 10 ? 1 : 0) + " s";
  long const s = std::lround(seconds);
  char text[48];
  if (s < 3600) {
    std::snprintf(text, sizeof text, "%ld:%02ld", s / 60, s % 60);
  } else {
    std::snprintf(text, sizeof text, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
  }
  return text;
}

std::string as_bytes(double bytes) {
  char const* const units[] = {"B", "kB", "MB", "GB", "TB"};
  int unit = 0;
  while (bytes >= 1000 && unit < 4) bytes /= 1000, ++unit;
  return fixed(bytes, unit == 0 || bytes >= 100 ? 0 : 1) + " " + units[unit];
}

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

}  // namespace gart_cli
