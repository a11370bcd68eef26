#include "evaluate.hpp"

#include <gart/core/error.hpp>
#include <gart/loss/metrics.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace gart_cli {

scores evaluate(std::vector<gart::dataset_view> const& views, gart::vec3 background,
                gart::exposure_field const& exposures, render_view const& render, keep_view const& keep) {
  scores result;
  result.exposed = !exposures.empty();
  double psnr_sum = 0, ssim_sum = 0, own_sum = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    auto const& view = views[i];
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
    psnr_sum += score.psnr, ssim_sum += score.ssim, own_sum += score.own_psnr;
    if (keep) keep(i, score, image, truth);
    result.views.push_back(std::move(score));
  }
  if (!views.empty()) {
    result.psnr = psnr_sum / static_cast<double>(views.size());
    result.ssim = ssim_sum / static_cast<double>(views.size());
    if (result.exposed) result.own_psnr = own_sum / static_cast<double>(views.size());
  }
  return result;
}

nlohmann::json to_json(scores const& result) {
  nlohmann::json all = {{"psnr", result.psnr}, {"ssim", result.ssim}, {"test_views", result.views.size()}};
  if (result.exposed) all["psnr_own_colours"] = result.own_psnr;
  all["views"] = nlohmann::json::array();
  for (auto const& v : result.views) {
    all["views"].push_back({{"name", v.name}, {"psnr", v.psnr}, {"ssim", v.ssim}, {"milliseconds", v.milliseconds}});
    if (result.exposed) all["views"].back()["psnr_own_colours"] = v.own_psnr;
  }
  return all;
}

}  // namespace gart_cli
