#pragma once
// A run of `gart train`: from the command line to the results in its folder.

#include "interrupt.hpp"
#include "progress.hpp"
#include "ranks.hpp"
#include "report/history.hpp"
#include "run_folder.hpp"
#include "scores.hpp"
#include "timing.hpp"
#include "train_arguments.hpp"
#include "training_view.hpp"

#include <gart/comm/row_owners.hpp>
#include <gart/runtime/session.hpp>

#include <memory>
#include <optional>

namespace gart_cli {

// The running means that the progress line shows.
struct recent_steps {
  double loss = 0, psnr = 0, seconds = 0, own = 0;  // own: of this rank's step by itself
  void add(gart::step_report const& report, double step_seconds, double own_seconds) {
    double const keep = count_ < 50 ? count_ / (count_ + 1.0) : 0.98;
    ++count_;
    loss = keep * loss + (1 - keep) * report.loss;
    psnr = keep * psnr + (1 - keep) * report.psnr;
    seconds = keep * seconds + (1 - keep) * step_seconds;
    own = keep * own + (1 - keep) * own_seconds;
  }

 private:
  int count_ = 0;
};

class training_run {
 public:
  explicit training_run(train_arguments& a)
      : a_(a), writes_(ranks::launched_rank() == 0), say_(a.quiet || !writes_), course_(course_of(a)) {
    ranks::start(false);
  }
  int run();  // the exit code

 private:
  // Before the first step (training_run.cpp).
  void read_capture();
  void load_start();
  void check_poses();
  void read_mirrors();
  void share_out();
  gart::configuration_request request() const;
  gart::row_owners owners() const;
  void say_memory();
  void say_choices();
  bool measure_capture(interrupt_guard const& interrupt);
  void begin();
  void enter();
  void load();
  void match_photographs();
  void begin_anew();
  void go_on();

  // The steps (training_steps.cpp).
  bool train(interrupt_guard const& interrupt);  // true when all steps are done, false when it was asked to stop
  static history course_of(train_arguments const& a);
  double progress_at(int step) const { return a_.progress(step, course_.seconds); }
  gart::step_report checked_step();
  void serve();
  bool attend(interrupt_guard const& interrupt, double seconds, gart::step_report const& report,
              recent_steps const& recent);  // false where a viewer stops it
  void show_curve();
  void show(gart::step_report const& report, recent_steps const& recent);

  // Scores and files (training_results.cpp).
  gart::scores score(gart::some_views const& views, gart::keep_view const& keep = {},
                     gart::place_view const& place = {});
  gart::scores test(int step, gart::keep_view const& keep = {}, gart::place_view const& place = {});
  gart::place_view aligned_to_photographs(std::vector<gart::named_camera>& found);
  gart::place_view as_learned() const;
  // In the coordinates of the capture and its files.
  std::vector<gart::named_camera> from_zero(std::vector<gart::named_camera> cameras) const;
  void save_checkpoint();
  void save();
  void conclude();
  std::string image_size() const;
  nlohmann::json metrics_of(gart::scores const& result, gart::scores const& training);

  train_arguments& a_;
  bool writes_;  // this rank does
  std::optional<run_lock> lock_;
  progress say_;
  history course_;
  gart::configuration_info configuration_;
  bool fell_back_ = false;
  gart::dataset data_;
  nlohmann::json chosen_, measured_, raised_ = nlohmann::json::array();
  gart::gaussian_model start_;  // of several ranks this one's rows
  gart::u64 start_total_ = 0;
  gart::vec3 eval_background_{0.0f};
  std::unique_ptr<gart::session> session_;
  std::unique_ptr<training_view> view_;
  std::size_t gaussians_ = 0;
  int steps_ = 0, profiled_steps_ = 0;
  int finite_steps_ = 0;               // steps of this process after which everything was finite, by --check-finite
  std::uint64_t skipped_updates_ = 0;  // numbers that Adam left as they were in them
  double load_seconds_ = 0, measure_seconds_ = 0, step_seconds_ = 0, test_seconds_ = 0, save_seconds_ = 0,
         profiled_seconds_ = 0;
};

}  // namespace gart_cli
