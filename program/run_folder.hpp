#pragma once
// The folder of a training run, DIR of `gart train --out DIR`: one program at a time writes there, and what a run
// replaces is an earlier run's, all of it.

#include <filesystem>
#include <string>

namespace gart_cli {

// Holds DIR/.gart.lock (flock) until it is destroyed, and then removes it. A program that dies leaves the file and no
// lock. Where the file cannot be made nothing is held: what keeps files from being written there is reported by those
// that write them. io_error, naming the process, where another one holds it.
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

// The background that a model of a run was trained on, by the config.json that lies beside it; empty where none does.
std::string background_of_run(std::filesystem::path const& model);

// What a run that was killed had begun to write, in the folder and its renders/. For who holds the folder's lock.
void remove_temporary_files(std::filesystem::path const& folder);

// What a run leaves at its end: metrics, the report, the test views' poses and the images of renders/.
void remove_results(std::filesystem::path const& folder);
// And what it leaves on its way: the model, its exposures and poses, the checkpoint and the history. config.json stays,
// lest a run that is being replaced leave a folder that is not known for gart's.
void remove_run(std::filesystem::path const& folder);

}  // namespace gart_cli
