#pragma once
// Ctrl-C and SIGTERM as a wish that is asked for between steps, so that a run ends with its files whole. A second one
// ends the program at once.

#include <csignal>

namespace gart_cli {

class interrupt_guard {
 public:
  interrupt_guard() {
    wanted_ = 0;
    struct sigaction action = {};
    action.sa_handler = [](int) { wanted_ = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, &old_int_);
    sigaction(SIGTERM, &action, &old_term_);
  }
  ~interrupt_guard() {
    sigaction(SIGINT, &old_int_, nullptr);
    sigaction(SIGTERM, &old_term_, nullptr);
  }
  interrupt_guard(interrupt_guard const&) = delete;
  interrupt_guard& operator=(interrupt_guard const&) = delete;

  bool wanted() const { return wanted_ != 0; }

 private:
  static inline std::sig_atomic_t volatile wanted_ = 0;
  struct sigaction old_int_ = {}, old_term_ = {};
};

}  // namespace gart_cli
