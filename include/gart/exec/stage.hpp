#pragma once
/// \file
/// Times what runs while it lives under `label`, when the policy's profiler is on.

#include <gart/exec/concepts.hpp>

namespace gart {

/// A stage, from its construction to its end.
template <execution E>
class stage_scope {
 public:
  /// `label` is kept by its address.
  stage_scope(E& exec, char const* label) : exec_(exec), timed_(exec.profile.enabled()) {
    if (timed_) exec_.begin_stage(label);
  }
  ~stage_scope() {
    if (timed_) exec_.end_stage();
  }
  stage_scope(stage_scope const&) = delete;
  stage_scope& operator=(stage_scope const&) = delete;

 private:
  E& exec_;
  bool timed_;
};

}  // namespace gart
