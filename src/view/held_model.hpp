#pragma once
// The Gaussians that a renderer holds for a viewer: the model as it is, or changed by a view's settings.

#include <gart/render/options.hpp>
#include <gart/view/scene.hpp>
#include <gart/view/shown_features.hpp>

#include <functional>
#include <utility>
#include <vector>

namespace gart::view {

class held_model {
 public:
  // `give` hands Gaussians to the renderer; it is not called where none are left, unless `with_none`.
  held_model(gaussian_model model, render_options const& options, int kernel_degree,
             std::function<void(gaussian_model const&)> give, bool with_none = false)
      : feature_count_(std::exchange(model.feature_count, 0)),
        features_(std::exchange(model.features, {})),
        model_(std::move(model)),
        options_(options),
        kernel_degree_(kernel_degree),
        extent_(extent_of(scene_of("", model_, 2))),
        give_(std::move(give)),
        with_none_(with_none) {
    hand_on(model_);
  }

  std::size_t left() const { return left_; }
  bool has_features() const { return feature_count_ > 0; }
  // Of the last that were taken.
  shown_features const& features() const { return shown_; }

  // Gives the renderer the Gaussians of a view. Whether these were others before.
  bool take(view_settings const& s) {
    bool const other_features = s.features && s.features != held_.features;
    if (s.crop == held_.crop && s.opacity == held_.opacity && s.size == held_.size && s.shape == held_.shape &&
        !other_features)
      return false;
    if (other_features)
      shown_ = features_to_show({features_.data(), static_cast<index_t>(model_.size()), feature_count_}, *s.features);
    if (s.features || !s.own_gaussians()) {
      gaussian_model part = model_;
      if (s.features) part.feature_count = shown_.count, part.features = shown_.values;
      hand_on(s.own_gaussians() ? part : altered(std::move(part), s, kernel_degree_, extent_));
    } else {
      hand_on(model_);
    }
    held_ = s;
    return true;
  }
  render_options options_for(view_settings const& settings) const {
    render_options out = options_;
    if (settings.near) out.near = *settings.near;
    if (settings.background) out.background = *settings.background;
    if (settings.shape != view_shape::gaussians) out.alpha_min = solid_response, out.antialias = 0;
    out.rows = settings.rows;
    return out;
  }

 private:
  void hand_on(gaussian_model const& taken) {
    left_ = taken.size();
    if (left_ > 0 || with_none_) give_(taken);
  }

  int feature_count_;
  std::vector<float> features_;  // [N][feature_count], of which few are shown at a time
  gaussian_model model_;         // without them
  render_options options_;
  int kernel_degree_;
  float extent_;
  std::function<void(gaussian_model const&)> give_;
  bool with_none_;
  view_settings held_ = {};  // of the Gaussians that the renderer holds
  shown_features shown_ = {};
  std::size_t left_ = 0;  // how many these are
};

}  // namespace gart::view
