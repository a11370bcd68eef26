#pragma once
// Turns Ctrl-C, SIGTERM and SIGHUP into a flag that the run reads between steps, so that its files end whole. A second
// signal ends the program at once, if it comes a second or more later. A terminal and a parent may each send one. The
// handler stays after the first signal: the second may come while the program ends. An ignored SIGHUP (nohup) stays
// ignored.

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
    for (watched& w : signals_) {
      sigaction(w.number, nullptr, &w.before);
      bool const outlived = w.number == SIGHUP && w.before.sa_handler == SIG_IGN;
      if (!outlived) sigaction(w.number, &action, nullptr);
    }
  }
  ~interrupt_guard() {
    if (wanted_) return;
    for (watched const& w : signals_) sigaction(w.number, &w.before, nullptr);
  }
  interrupt_guard(interrupt_guard const&) = delete;
  interrupt_guard& operator=(interrupt_guard const&) = delete;

  bool wanted() const { return wanted_ != 0; }

 private:
  static inline std::sig_atomic_t volatile wanted_ = 0;
  static inline long volatile first_ = 0;  // when, in tenths of a second
  struct watched {
    int number;
    struct sigaction before = {};
  };
  watched signals_[3] = {{SIGINT}, {SIGTERM}, {SIGHUP}};
};

// While it exists SIGPIPE does not end the program: the reader of its progress may be gone.
class broken_pipe_guard {
 public:
  broken_pipe_guard() {
    struct sigaction action = {};
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, &before_);
  }
  ~broken_pipe_guard() { sigaction(SIGPIPE, &before_, nullptr); }
  broken_pipe_guard(broken_pipe_guard const&) = delete;
  broken_pipe_guard& operator=(broken_pipe_guard const&) = delete;

 private:
  struct sigaction before_ = {};
};

}  // namespace gart_cli
