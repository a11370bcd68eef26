#include "evaluate.hpp"

#include "progress.hpp"

#include <gart/core/error.hpp>
#include <gart/loss/affine_color.hpp>
#include <gart/loss/metrics.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace gart_cli {

some_views all_of(std::vector<gart::dataset_view> const& views) { return evenly_spread(views, views.size()); }

some_views evenly_spread(std::vector<gart::dataset_view> const& views, std::size_t count) {
  some_views result;
  count = std::min(count, views.size());
  for (std::size_t i = 0; i < count; ++i) result.push_back(&views[(2 * i + 1) * views.size() / (2 * count)]);
  return result;
}

scores evaluate(some_views const& views, gart::vec3 background, gart::exposure_field const& exposures,
                render_view const& render, keep_view const& keep) {
  scores result;
  result.exposed = !exposures.empty();
  double psnr_sum = 0, ssim_sum = 0, affine_sum = 0, own_sum = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    auto const& view = *views[i];
    view_score score;
    score.name = view.name;
    auto const start = std::chrono::steady_clock::now();
    gart::image_float image = render(view.view).color;
    score.milliseconds = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    gart::image_float const truth = gart::composited(view.image, background);
    if (image.data.size() != truth.data.size()) {
      throw gart::error(view.name + ": rendered at " + std::to_string(image.width) + " x " +
                        std::to_string(image.height) + ", but its photograph has " + std::to_string(truth.width) +
                        " x " + std::to_string(truth.height));
    }
    gart::image_float scored;
    auto const score_psnr = [&] {
      for (float& v : image.data) v = std::clamp(v, 0.0f, 1.0f);
      scored = image;
      double const share = gart::apply_mask(view.mask, truth, scored);
      return gart::masked_psnr(scored, truth, share);
    };
    if (result.exposed) {
      gart::image_float const own = image;
      score.own_psnr = score_psnr();
      image = own;
      apply(exposures.at(view.view), image);
    }
    score.psnr = score_psnr();
    score.ssim = gart::ssim(scored, truth);
    score.affine_psnr = gart::psnr_affine_color(image, truth, view.mask);
    psnr_sum += score.psnr, ssim_sum += score.ssim, affine_sum += score.affine_psnr, own_sum += score.own_psnr;
    if (keep) keep(i, score, image, truth);
    result.views.push_back(std::move(score));
  }
  if (!views.empty()) {
    result.psnr = psnr_sum / static_cast<double>(views.size());
    result.ssim = ssim_sum / static_cast<double>(views.size());
    result.affine_psnr = affine_sum / static_cast<double>(views.size());
    if (result.exposed) result.own_psnr = own_sum / static_cast<double>(views.size());
  }
  return result;
}

nlohmann::json to_json(scores const& result) {
  nlohmann::json all = {{"psnr", result.psnr}, {"ssim", result.ssim}, {"psnr_affine_colour", result.affine_psnr}};
  if (result.exposed) all["psnr_own_colours"] = result.own_psnr;
  all["views"] = nlohmann::json::array();
  for (auto const& v : result.views) {
    all["views"].push_back({{"name", v.name},
                            {"psnr", v.psnr},
                            {"ssim", v.ssim},
                            {"psnr_affine_colour", v.affine_psnr},
                            {"milliseconds", v.milliseconds}});
    if (result.exposed) all["views"].back()["psnr_own_colours"] = v.own_psnr;
  }
  return all;
}

nlohmann::json to_json(scores const& test, scores const& training, std::size_t train_views) {
  nlohmann::json all = to_json(test);
  all["test_views"] = test.views.size(), all["train_views"] = train_views;
  all["training_scores"] = to_json(training);
  all["training_scores"]["scored_views"] = training.views.size();
  return all;
}

std::string in_words(scores const& test, scores const& training, std::size_t train_views) {
  auto const both = [](scores const& s) { return fixed(s.psnr, 2) + " dB, SSIM " + fixed(s.ssim, 4) + " over "; };
  std::string text = "test PSNR " + both(test) + std::to_string(test.views.size()) +
                     " views; after the best affine colour of each " + fixed(test.affine_psnr, 2) +
                     " dB, a diagnostic\n";
  if (training.views.empty()) return text;
  return text + "training PSNR " + both(training) + std::to_string(training.views.size()) + " of " +
         std::to_string(train_views) + " views\n";
}

}  // namespace gart_cli
