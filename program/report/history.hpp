#pragma once
// The course of a training run, for the curves of its report. Any number of steps gives a few hundred points. The file
// history.json beside the checkpoint keeps it, so a resumed run has the whole curve.

#include <gart/runtime/session.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <vector>

namespace gart_cli {

class history {
 public:
  struct train_point {  // loss and PSNR are means over the steps since the point before
    int step = 0;
    double seconds = 0, loss = 0, psnr = 0, gaussians = 0;
  };
  struct test_point {
    int step = 0;
    double psnr = 0, ssim = 0, seconds = 0;  // of training until then
  };
  std::vector<train_point> train;
  std::vector<test_point> test;
  double seconds = 0;  // of training, evaluation and saving left out

  explicit history(int iterations) : spacing_(iterations > 200 ? iterations / 200 : 1) {}
  void add(gart::step_report const& report);
  // Ends the mean that is being formed, so that nothing is lost by stopping here.
  void close_point();
  nlohmann::json to_json() const;
  // The points of PSNR over training seconds: "test" and "train", each a list of rows by its "..._columns".
  nlohmann::json psnr_over_seconds() const;
  // Reads the points up to `step`: a checkpoint may be older than the history beside it. Throws io_error for a file
  // that is no history.
  void restore(std::filesystem::path const& file, int step);

 private:
  // Of training when a step was done, by the curve; for files that have no seconds at their tests.
  double seconds_at(int step) const;

  int spacing_, pending_ = 0;
  train_point sum_;
};

}  // namespace gart_cli
