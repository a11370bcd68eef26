#pragma once
// The viewer of a running training: it renders views and answers requests between steps.

#include "interrupt.hpp"
#include "train_arguments.hpp"

#include <gart/runtime/evaluate.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/view/pacing.hpp>
#include <gart/view/server.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

namespace gart_cli {

class training_view {
 public:
  // Serves from here on. The session and the dataset must outlive it.
  training_view(train_arguments const& a, gart::session& session, gart::dataset const& data, gart::vec3 background);

  // Whether nobody is there and nothing was asked: one atomic load, and all that a training without a viewer pays.
  bool idle() const noexcept { return server_.idle() && !paused_; }

  // Called between two steps with the last one's duration. Sends the state, renders views while time is left, does what
  // clients asked, and waits while the training is paused. `save` writes the checkpoint, and says where. False where
  // the training is to stop.
  bool attend(double step_seconds, gart::view_status status, interrupt_guard const& interrupt,
              std::function<std::string()> const& save);
  // The message to the pages when the viewer ends.
  void end(std::string const& why);
  void set_scores(gart::dataset const& data, gart::scores const& test);
  void set_curve(gart::view_curve const& curve) { server_.set_curve(curve); }
  gart::view_server const& server() const { return server_; }
  // Seconds that went into views.
  double seconds() const { return seconds_; }

 private:
  using clock = std::chrono::steady_clock;
  gart::view_render copy();

  train_arguments const& a_;
  gart::session& session_;
  float extent_;
  gart::vec3 background_;
  gart::view_server server_;
  std::unique_ptr<opened_browser> const browser_;
  gart::view_render const render_;
  gart::time_share share_;
  std::unique_ptr<gart::renderer> part_;  // of views that alter the Gaussians
  bool paused_ = false;
  double seconds_ = 0;
  clock::time_point told_{};
};

}  // namespace gart_cli
