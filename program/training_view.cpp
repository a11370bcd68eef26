#include "training_view.hpp"

#include <utility>

namespace gart_cli {

namespace {

using std::chrono::duration;

gart::view_scene scene_of(train_arguments const& a, gart::session& session, gart::dataset const& data,
                          gart::vec3 background) {
  gart::view_scene scene = gart::scene_of(a.out.filename().empty() ? a.out.string() : a.out.filename().string(),
                                          session.model(), a.kernel_degree, view_cameras_of(data));
  scene.training = true, scene.background = background;
  return scene;
}

gart::view_server_options options_of(train_arguments const& a, gart::dataset const& data) {
  gart::view_server_options options = server_options_of(a.view, data);
  options.frame_seconds = 1.0 / 30;  // of a small share more views are to be had where each is shorter
  return options;
}

}  // namespace

training_view::training_view(train_arguments const& a, gart::session& session, gart::dataset const& data,
                             gart::vec3 background)
    : a_(a),
      session_(session),
      extent_(data.extent),
      background_(background),
      server_(scene_of(a, session, data, background), options_of(a, data)),
      render_(
          [this](gart::camera const& view, gart::view_settings const& left_out) {
            return left_out.crop || left_out.near ? part().images(view, left_out) : session_.render(view, background_);
          },
          [this](gart::camera const& view, gart::view_settings const& left_out) {
            return left_out.crop || left_out.near ? part().colours(view, left_out)
                                                  : session_.render_8bit(view, background_);
          }),
      share_(a.view_share) {}

// What leaves something out is rendered from a copy of the Gaussians as they are now.
gart::view_render training_view::part() {
  gart::gaussian_model model = session_.model();
  if (!part_ || part_->configuration().sh_degree != model.sh_degree) {
    gart::configuration_request request = configuration_request_of(a_);
    request.sh_degree = model.sh_degree;
    part_ = gart::make_renderer(request);
  }
  return gart::render_of(*part_, std::move(model), gart::render_options_of(train_options_of(a_), extent_, background_));
}

bool training_view::attend(double step_seconds, gart::view_status status, interrupt_guard const& interrupt,
                           std::function<void()> const& save) {
  share_.worked(step_seconds);
  for (bool once = true; once || paused_; once = false) {
    bool step = false;
    while (auto const action = server_.next_action()) {
      switch (*action) {
        case gart::train_action::pause:
          paused_ = true;
          break;
        case gart::train_action::resume:
          paused_ = false;
          break;
        case gart::train_action::step:
          paused_ = step = true;
          break;
        case gart::train_action::save:
          save();
          break;
        case gart::train_action::stop:
          return false;
      }
      told_ = {};
      if (step) break;
    }
    if (auto const share = server_.next_share()) share_.set(*share), told_ = {};
    if (interrupt.wanted()) return true;  // the caller looks for it too
    auto const now = clock::now();
    if (duration<double>(now - told_).count() >= 0.25) {
      status.paused = paused_, status.view_share = share_.share();
      server_.set_status(status);
      told_ = now;
    }
    if (step) return true;
    if (paused_) {
      seconds_ += server_.render_next(render_, 0.1);
    } else {
      double const rendered = share_.may_view() ? server_.render_next(render_, 0) : 0;
      seconds_ += rendered;
      // All that a step does for its viewers is of their share, not the images alone.
      share_.viewed(duration<double>(clock::now() - now).count(), rendered > 0);
    }
  }
  return true;
}

}  // namespace gart_cli
