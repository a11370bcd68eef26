#pragma once
// Ctrl-C and SIGTERM as a wish that is asked for between steps, so that a run ends with its files whole. A second one
// ends the program at once, but not within a second of the first: one wish may come twice, from a terminal to all of
// its programs and from the one that waits for this. After a wish the handler stays, for the second may come while the
// program takes its leave.

#include <csignal>
#include <ctime>

namespace gart_cli {

class interrupt_guard {
 public:
  interrupt_guard() {
    wanted_ = 0;
    struct sigaction action = {};
    action.sa_handler = [](int signal) {
      timespec now = {};
      clock_gettime(CLOCK_MONOTONIC, &now);
      long const tenths = static_cast<long>(now.tv_sec) * 10 + now.tv_nsec / 100000000;
      if (!wanted_) {
        wanted_ = 1;
        first_ = tenths;
      } else if (tenths - first_ >= 10) {
        std::signal(signal, SIG_DFL);
        std::raise(signal);
      }
    };
    sigaction(SIGINT, &action, &old_int_);
    sigaction(SIGTERM, &action, &old_term_);
  }
  ~interrupt_guard() {
    if (wanted_) return;
    sigaction(SIGINT, &old_int_, nullptr);
    sigaction(SIGTERM, &old_term_, nullptr);
  }
  interrupt_guard(interrupt_guard const&) = delete;
  interrupt_guard& operator=(interrupt_guard const&) = delete;

  bool wanted() const { return wanted_ != 0; }

 private:
  static inline std::sig_atomic_t volatile wanted_ = 0;
  static inline long volatile first_ = 0;  // when, in tenths of a second
  struct sigaction old_int_ = {}, old_term_ = {};
};

}  // namespace gart_cli
