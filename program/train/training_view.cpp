#include "training_view.hpp"

#include "progress.hpp"

#include <utility>

namespace gart_cli {

namespace {

using std::chrono::duration;

gart::view_scene scene_of(train_arguments const& a, gart::session& session, gart::dataset const& data,
                          gart::vec3 background) {
  gart::view_scene scene = gart::scene_of(a.out.filename().empty() ? a.out.string() : a.out.filename().string(),
                                          session.model(), a.kernel_degree, view_cameras_of(data));
  scene.training = true, scene.background = background, scene.origin = data.origin;
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
      browser_(open_address(server_, a.view)),
      render_(
          [this](gart::camera const& view, gart::view_settings const& s) {
            return s.own_gaussians() && !s.near ? session_.render(view, s.background.value_or(background_))
                                                : copy().images(view, s);
          },
          [this](gart::camera const& view, gart::view_settings const& s) {
            return s.own_gaussians() && !s.near ? session_.render_8bit(view, s.background.value_or(background_))
                                                : copy().colours(view, s);
          }),
      share_(a.view_share) {}

// What alters the Gaussians is rendered from a copy of them as they are now.
gart::view_render training_view::copy() {
  gart::gaussian_model model = session_.model();
  if (!part_ || part_->configuration().sh_degree != model.sh_degree) {
    gart::configuration_request request = configuration_request_of(a_);
    request.sh_degree = model.sh_degree;
    part_ = gart::make_renderer(request);
  }
  return gart::render_of(*part_, std::move(model), gart::render_options_of(train_options_of(a_), extent_, background_));
}

void training_view::end(std::string const& why) { server_.tell_at_end(why); }

void training_view::set_scores(gart::dataset const& data, gart::scores const& test) {
  std::vector<std::pair<int, double>> scores;
  for (std::size_t i = 0; i < test.views.size() && test.views.size() == data.test.size(); ++i)
    scores.emplace_back(static_cast<int>(data.train.size() + i), test.views[i].psnr);
  server_.set_scores(scores);
}

bool training_view::attend(double step_seconds, gart::view_status status, interrupt_guard const& interrupt,
                           std::function<std::string()> const& save) {
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
          server_.tell("Saved " + save() + " at step " + with_commas(static_cast<std::uint64_t>(status.step)) + ".");
          break;
        case gart::train_action::stop:
          server_.tell("The training stops after step " + with_commas(static_cast<std::uint64_t>(status.step)) +
                       ", and is being saved.");
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
