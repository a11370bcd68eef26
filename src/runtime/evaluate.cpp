#include <gart/core/error.hpp>
#include <gart/loss/affine_color.hpp>
#include <gart/loss/metrics.hpp>
#include <gart/runtime/evaluate.hpp>

#include <algorithm>
#include <chrono>
#include <utility>

namespace gart {

some_views all_of(std::vector<dataset_view> const& views) { return evenly_spread(views, views.size()); }

some_views evenly_spread(std::vector<dataset_view> const& views, std::size_t count) {
  some_views result;
  count = std::min(count, views.size());
  for (std::size_t i = 0; i < count; ++i) result.push_back(&views[(2 * i + 1) * views.size() / (2 * count)]);
  return result;
}

scores evaluate(some_views const& views, vec3 background, exposure_field const& exposures, render_view const& render,
                keep_view const& keep, place_view const& place) {
  scores result;
  result.exposed = !exposures.empty(), result.placed = static_cast<bool>(place);
  for (std::size_t i = 0; i < views.size(); ++i) {
    auto const& view = *views[i];
    view_score score;
    score.name = view.name;
    camera const placed = place ? place(view) : view.view;
    auto const start = std::chrono::steady_clock::now();
    image_float image = render(placed).color;
    score.milliseconds = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    image_float const truth = composited(view.image, background);
    if (image.data.size() != truth.data.size()) {
      throw error(view.name + ": rendered at " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                  ", but its photograph has " + std::to_string(truth.width) + " x " + std::to_string(truth.height));
    }
    image_float scored;
    auto const score_psnr = [&] {
      for (float& v : image.data) v = std::clamp(v, 0.0f, 1.0f);
      scored = image;
      double const share = apply_mask(view.mask, truth, scored);
      return masked_psnr(scored, truth, share);
    };
    if (result.exposed) {
      image_float const own = image;
      score.own_psnr = score_psnr();
      image = own;
      apply(exposures.at(view.view), image);
    }
    score.psnr = score_psnr();
    score.ssim = ssim(scored, truth);
    score.affine_psnr = psnr_affine_color(image, truth, view.mask);
    if (place) {
      image_float const kept = std::exchange(image, render(view.view).color);
      apply(exposures.at(view.view), image);
      score.captured_psnr = score_psnr();
      image = kept;
    }
    if (keep) keep(i, score, image, truth);
    result.views.push_back(std::move(score));
  }
  take_means(result);
  return result;
}

void take_means(scores& of) {
  if (of.views.empty()) return;
  auto const mean = [&](double view_score::*value) {
    double sum = 0;
    for (view_score const& v : of.views) sum += v.*value;
    return sum / static_cast<double>(of.views.size());
  };
  of.psnr = mean(&view_score::psnr), of.ssim = mean(&view_score::ssim), of.affine_psnr = mean(&view_score::affine_psnr);
  if (of.placed) of.captured_psnr = mean(&view_score::captured_psnr);
  if (of.exposed) of.own_psnr = mean(&view_score::own_psnr);
}

}  // namespace gart
