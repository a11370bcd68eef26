#include "open_browser.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

extern char** environ;

namespace gart_cli {

namespace {

std::string from_environment(char const* name) {
  char const* const value = std::getenv(name);
  return value ? value : "";
}

// The program's own output is no place for a browser's. True where it could be started and, within a moment, no
// failure came back.
bool start(std::string const& program, std::string const& argument) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (int const descriptor : {0, 1, 2}) posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_RDWR, 0);
  std::string name = program, file = argument;
  char* const arguments[] = {name.data(), file.data(), nullptr};
  pid_t child = 0;
  bool const started = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments, environ) == 0;
  posix_spawn_file_actions_destroy(&actions);
  if (!started) return false;
  for (int waited_ms = 0; waited_ms < 500; waited_ms += 20) {
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) return WIFEXITED(status) && WEXITSTATUS(status) == 0;
    usleep(20000);
  }
  return true;
}

}  // namespace

opened_browser::opened_browser(std::string const& address) {
  std::string const named = from_environment("BROWSER");
  if (named.empty() && from_environment("DISPLAY").empty() && from_environment("WAYLAND_DISPLAY").empty()) {
    said = "--open: there is no display here (open the address yourself)";
    return;
  }
  std::string const runtime = from_environment("XDG_RUNTIME_DIR");
  std::string name =
      (runtime.empty() ? std::filesystem::temp_directory_path().string() : runtime) + "/gart-XXXXXX.html";
  int const file = mkstemps(name.data(), 5);  // which no other user may read
  std::string const page =
      "<!doctype html><meta charset=\"utf-8\"><title>gart</title>"
      "<meta http-equiv=\"refresh\" content=\"0; url=" +
      address + "\"><a href=\"" + address + "\">gart</a>\n";
  bool const written = file >= 0 && write(file, page.data(), page.size()) == static_cast<ssize_t>(page.size());
  if (file >= 0) close(file), file_ = name;
  std::string const program = named.empty() ? "xdg-open" : named;
  if (!written || !start(program, name)) said = "--open: " + program + " could not open it (open the address yourself)";
}

opened_browser::~opened_browser() {
  std::error_code ignored;
  if (!file_.empty()) std::filesystem::remove(file_, ignored);
}

}  // namespace gart_cli
