#pragma once
// The test views of report.html: render and photograph under one slider, and the error beside them.

#include <gart/scene/image.hpp>

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace gart_cli {

// A test view as the page shows it; images as JPEG.
struct report_view {
  std::string name;
  double psnr = 0, ssim = 0;
  std::vector<gart::u8> render, truth, error;
};

// Scaled down by a whole factor where the images are wide. The error is the mean over channels of |render - truth|,
// coloured over [0, gart::default_error_scale].
report_view make_report_view(std::string const& name, double psnr, double ssim, gart::image_float const& render,
                             gart::image_float const& truth);

// A picture of the model, at the top of the page; no JPEG where nothing was rendered.
struct report_cover {
  std::string name;
  std::vector<gart::u8> jpeg;
};
report_cover make_report_cover(std::string const& name, gart::image_float const& render);

// Chooses the views of the page while they are rendered: at most 12, evenly spread, and the worst of all.
class report_views {
 public:
  // View `index` of `total`, in order.
  void add(std::size_t index, std::size_t total, std::string const& name, double psnr, double ssim,
           gart::image_float const& render, gart::image_float const& truth);
  // The lowest PSNR first.
  std::vector<report_view> worst_first() const;
  // The one in the middle of them.
  report_cover const& cover() const { return cover_; }

 private:
  report_cover cover_;
  std::vector<report_view> spread_;
  std::optional<report_view> worst_;  // of those that are not in spread_
  double least_ = 0;                  // PSNR of the worst so far
  bool any_ = false;
};

// As HTML: these views, and the scores of all in "views" of metrics.json.
std::string report_pictures(nlohmann::json const& metrics, std::vector<report_view> const& shown);

}  // namespace gart_cli
