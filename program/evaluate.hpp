#pragma once
// Scores of rendered views against photographs: PSNR and SSIM (gart/loss/metrics.hpp), and as a diagnostic PSNR after
// each view's best affine colour (gart/loss/affine_color.hpp); the mean over views.

#include <gart/exposure/exposure_field.hpp>
#include <gart/io/dataset.hpp>
#include <gart/runtime/session.hpp>

#include <nlohmann/json.hpp>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace gart_cli {

struct view_score {
  std::string name;
  double psnr = 0, ssim = 0;
  double affine_psnr = 0;   // after the affine colour that fits best
  double own_psnr = 0;      // without an exposure: of the scene's own colours
  double milliseconds = 0;  // of rendering, to an image in host memory
};

struct scores {
  double psnr = std::numeric_limits<double>::quiet_NaN();  // stays so where there are no views
  double ssim = std::numeric_limits<double>::quiet_NaN();
  double affine_psnr = std::numeric_limits<double>::quiet_NaN();
  double own_psnr = std::numeric_limits<double>::quiet_NaN();
  bool exposed = false;
  std::vector<view_score> views;
};

using some_views = std::vector<gart::dataset_view const*>;
some_views all_of(std::vector<gart::dataset_view> const& views);
// At most `count` of them, from the middles of as many equal parts: the same in every run.
some_views evenly_spread(std::vector<gart::dataset_view> const& views, std::size_t count);

using render_view = std::function<gart::rendered(gart::camera const&)>;
// Sees each view as it was scored, in order.
using keep_view = std::function<void(std::size_t index, view_score const&, gart::image_float const& render,
                                     gart::image_float const& truth)>;

// Where there are exposures each view is scored with its own, as the field gives it for the camera.
scores evaluate(some_views const& views, gart::vec3 background, gart::exposure_field const& exposures,
                render_view const& render, keep_view const& keep = {});

// "psnr", "ssim", "psnr_affine_colour" and "views", and with exposures "psnr_own_colours"; null where there is no
// number.
nlohmann::json to_json(scores const& result);
// "test_views" and the scores of the test views, and under "training_scores" those of the training views that were
// rendered for comparison, with their number, "scored_views", of "train_views".
nlohmann::json to_json(scores const& test, scores const& training, std::size_t train_views);
// As a command says them when it is done.
std::string in_words(scores const& test, scores const& training, std::size_t train_views);

}  // namespace gart_cli
