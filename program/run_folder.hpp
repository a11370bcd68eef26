#pragma once
// The folder of a training run, DIR of `gart train --out DIR`. One program at a time writes there. A run replaces all
// files of an earlier run, and no others.

#include <filesystem>
#include <string>

namespace gart_cli {

// Holds DIR/.gart.lock (flock) until it is destroyed, and then removes it. A program that dies leaves the file and no
// lock. Holds nothing where the file cannot be made: writers report the cause. Throws io_error, naming the process,
// where another one holds it.
class run_lock {
 public:
  explicit run_lock(std::filesystem::path const& folder);
  ~run_lock();
  run_lock(run_lock const&) = delete;
  run_lock& operator=(run_lock const&) = delete;

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

// io_error, naming it, for a file that a run would replace where no run of gart's left it.
void refuse_foreign_files(std::filesystem::path const& folder);

// The background that a run's model was trained on, from the config.json beside it; empty without one.
std::string background_of_run(std::filesystem::path const& model);

// The unfinished files of a killed run, in the folder and its renders/. For who holds the folder's lock.
void remove_temporary_files(std::filesystem::path const& folder);

// A run's files from its end: metrics, the report, the test views' poses and the images of renders/.
void remove_results(std::filesystem::path const& folder);
// Removes the intermediate files too: model, exposures, poses, checkpoint and history. The file config.json stays, so
// that the folder is always known as gart's.
void remove_run(std::filesystem::path const& folder);

}  // namespace gart_cli
