#include "scores.hpp"

#include "progress.hpp"

#include <gart/core/words.hpp>

#include <cmath>

namespace gart_cli {

nlohmann::json to_json(gart::scores const& result) {
  nlohmann::json all = {{"psnr", result.psnr}, {"ssim", result.ssim}, {"psnr_affine_colour", result.affine_psnr}};
  if (result.exposed) all["psnr_own_colours"] = result.own_psnr;
  if (result.placed) all["psnr_capture_poses"] = result.captured_psnr;
  all["views"] = nlohmann::json::array();
  for (auto const& v : result.views) {
    all["views"].push_back({{"name", v.name},
                            {"psnr", v.psnr},
                            {"ssim", v.ssim},
                            {"psnr_affine_colour", v.affine_psnr},
                            {"milliseconds", v.milliseconds}});
    if (result.placed) all["views"].back()["psnr_capture_poses"] = v.captured_psnr;
    if (result.exposed) all["views"].back()["psnr_own_colours"] = v.own_psnr;
  }
  return all;
}

nlohmann::json to_json(gart::scores const& test, gart::scores const& training, std::size_t train_views) {
  nlohmann::json all = to_json(test);
  all["test_views"] = test.views.size(), all["train_views"] = train_views;
  all["training_scores"] = to_json(training);
  all["training_scores"]["scored_views"] = training.views.size();
  return all;
}

std::string in_words(gart::scores const& test, gart::scores const& training, std::size_t train_views) {
  auto const both = [](gart::scores const& s) { return fixed(s.psnr, 2) + " dB, SSIM " + fixed(s.ssim, 4) + " over "; };
  std::string text = "test PSNR " + both(test) + gart::counted(test.views.size(), "view");
  if (std::isfinite(test.affine_psnr))
    text += "; after the best affine colour of each " + fixed(test.affine_psnr, 2) + " dB, a diagnostic";
  text += "\n";
  if (test.placed)
    text += "test views aligned to their photographs, which they were scored by; at the capture's poses " +
            fixed(test.captured_psnr, 2) + " dB\n";
  if (training.views.empty()) return text;
  return text + "training PSNR " + both(training) + std::to_string(training.views.size()) + " of " +
         gart::counted(train_views, "view") + "\n";
}

}  // namespace gart_cli
