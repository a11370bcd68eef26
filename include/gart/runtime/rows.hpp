#pragma once
// The table of compiled rows behind make_session and make_renderer. A library that compiles rows registers them when it
// is loaded (GART_REGISTER_ROWS); a program that instantiates its own may do the same (examples/5_own_row).

#include <gart/runtime/session.hpp>

#include <memory>
#include <string>

namespace gart {

struct compiled_row {
  row_info row;
  int rank = 0;  // "auto" takes the highest that is available; rows that trade something lie below 0
  bool (*available)(std::string* reason);  // false: no device, with the reason
  std::unique_ptr<renderer> (*make_renderer)();
  std::unique_ptr<session> (*make_session)(train_options const&, dataset const&, gaussian_model const& start);
};

void register_row(compiled_row const& row);
inline bool always_available(std::string*) { return true; }

}  // namespace gart

// `name` becomes a symbol that the linker is told to keep, so that the object with the rows is not dropped.
#define GART_REGISTER_ROWS(name, ...) \
  extern "C" bool name;               \
  bool name = [] {                    \
    __VA_ARGS__;                      \
    return true;                      \
  }();
