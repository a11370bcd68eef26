#pragma once
// Opens an address in the browser of who started the program.

#include <filesystem>
#include <string>

namespace gart_cli {

// While it exists, a file that only this user can read leads to the address. All users can read a browser's command
// line, and the address is a key. Without a display or browser, `said` tells so and nothing else happens.
class opened_browser {
 public:
  explicit opened_browser(std::string const& address);
  ~opened_browser();
  opened_browser(opened_browser const&) = delete;
  opened_browser& operator=(opened_browser const&) = delete;

  std::string said;  // why it was not opened; empty where it was

 private:
  std::filesystem::path file_;
};

}  // namespace gart_cli
