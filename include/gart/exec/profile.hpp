#pragma once
/// \file
/// The cost of launches: wall time (CPU) or device time (events) summed per label. Off by default; when off it costs
/// one branch a launch. Labels are the ones given to parallel_for and to stage scopes.

#include <cstddef>
#include <map>
#include <string>

namespace gart {

/// Of one label.
struct stage_time {
  double milliseconds = 0;  ///< in all
  long launches = 0;        ///< how many
};

/// The times of a policy, by label.
class profiler {
 public:
  /// On or off.
  void enable(bool on) { enabled_ = on; }
  /// Whether it is on.
  bool enabled() const { return enabled_; }
  /// One launch more of a label.
  void add(std::string const& label, double milliseconds) {
    auto& stage = stages_[label];
    stage.milliseconds += milliseconds;
    ++stage.launches;
  }
  /// All that was measured.
  std::map<std::string, stage_time> const& stages() const { return stages_; }
  /// Forgets all that was measured.
  void clear() { stages_.clear(); }
  /// Adds the other's measurements, and leaves it empty.
  void take(profiler& other) {
    for (auto const& [label, time] : other.stages_) {
      stages_[label].milliseconds += time.milliseconds;
      stages_[label].launches += time.launches;
    }
    other.clear();
  }

 private:
  bool enabled_ = false;
  std::map<std::string, stage_time> stages_;
};

/// Bytes that buffers of one policy hold now and held at most.
struct memory_use {
  std::size_t current = 0, peak = 0;  ///< bytes
  /// So many bytes more.
  void allocated(std::size_t bytes) {
    current += bytes;
    if (current > peak) peak = current;
  }
  /// So many bytes less.
  void released(std::size_t bytes) { current -= bytes; }
};

}  // namespace gart
