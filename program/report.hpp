#pragma once
// report.html: how a training run went, in one page that needs no other file and no network. Figures come from what
// metrics.json and config.json say, so that page and files cannot disagree.

#include "history.hpp"

#include <gart/scene/image.hpp>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gart_cli {

// A test view as the page shows it; images as JPEG.
struct report_view {
  std::string name;
  double psnr = 0, ssim = 0;
  std::vector<gart::u8> render, truth, error;
};

// Views that the page has room for, out of `total`: at most 12, evenly spread.
bool in_report(std::size_t index, std::size_t total);
// Scaled down by a whole factor where the images are wide. The error is the mean over channels of |render - truth|,
// coloured over [0, gart::usual_error_scale].
report_view make_report_view(std::string const& name, double psnr, double ssim, gart::image_float const& render,
                             gart::image_float const& truth);

std::string report_page(nlohmann::json const& metrics, nlohmann::json const& config, history const& course,
                        std::vector<report_view> const& views);

}  // namespace gart_cli
