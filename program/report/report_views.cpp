#include "report_views.hpp"

#include "page_parts.hpp"
#include "progress.hpp"
#include "svg_chart.hpp"

#include <gart/io/image_file.hpp>
#include <gart/view/image_modes.hpp>

#include <algorithm>
#include <cmath>

namespace gart_cli {

namespace {

using nlohmann::json;

constexpr std::size_t parts = 12;

// The first of each of `parts` equal parts.
bool evenly_spread(std::size_t index, std::size_t total) {
  if (total <= parts || index == 0) return true;
  return index * parts / total != (index - 1) * parts / total;
}

std::string error_gradient() {
  std::string css = "linear-gradient(90deg";
  for (auto const& c : gart::error_colors)
    css += ", rgb(" + std::to_string(c[0]) + "," + std::to_string(c[1]) + "," + std::to_string(c[2]) + ")";
  return css + ")";
}

// Without scripts the slider stays where it is, in the middle.
constexpr char slide_script[] =
    "<script>for (const s of document.querySelectorAll('.slide input')) s.addEventListener('input', () => "
    "s.parentElement.style.setProperty('--at', s.value + '%'));</script>";

std::string figure_of(report_view const& v) {
  std::string const name = html_escape(v.name);
  return "<figure class=\"view\"><figcaption><b>" + name + "</b><span>" + fixed(v.psnr, 2) + " dB</span><span>SSIM " +
         fixed(v.ssim, 4) + "</span></figcaption><div class=\"images\"><div class=\"slide\">" +
         page_image(v.truth, name + ", photograph") + page_image(v.render, name + ", render") +
         "<i></i><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"" + name +
         ": share of the render beside the photograph\"></div>" + page_image(v.error, name + ", error") +
         "</div></figure>";
}

std::string all_scores(json const& views) {
  std::string html =
      "<details><summary>Scores of every test view</summary><div class=\"columns\">"
      "<table><tr><th>View</th><th class=\"n\">PSNR, dB</th><th class=\"n\">SSIM</th><th "
      "class=\"n\">affine, dB</th><th class=\"n\">Render, ms</th></tr>";
  for (auto const& v : views) {
    html += "<tr><td class=\"v\">" + text_of(v, "name") + "</td><td class=\"n\">" + fixed(number_of(v, "psnr"), 2) +
            "</td><td class=\"n\">" + fixed(number_of(v, "ssim"), 4) + "</td><td class=\"n\">" +
            fixed(number_of(v, "psnr_affine_colour"), 2) + "</td><td class=\"n\">" +
            fixed(number_of(v, "milliseconds"), 1) + "</td></tr>";
  }
  return html + "</table></div></details>";
}

}  // namespace

report_view make_report_view(std::string const& name, double psnr, double ssim, gart::image_float const& render,
                             gart::image_float const& truth) {
  gart::image_float difference(render.width, render.height, 1);
  for (std::size_t p = 0; p < difference.data.size(); ++p) {
    float sum = 0;
    for (int c = 0; c < 3; ++c) sum += std::abs(render.data[3 * p + c] - truth.data[3 * p + c]);
    difference.data[p] = sum / 3;
  }
  return {name,
          psnr,
          ssim,
          page_jpeg(gart::to_8bit(render)),
          page_jpeg(gart::to_8bit(truth)),
          page_jpeg(gart::error_in_colors(difference, gart::default_error_scale))};
}

report_cover make_report_cover(std::string const& name, gart::image_float const& render) {
  return {name, page_jpeg(gart::to_8bit(render), 960)};
}

void report_views::add(std::size_t index, std::size_t total, std::string const& name, double psnr, double ssim,
                       gart::image_float const& render, gart::image_float const& truth) {
  bool const spread = evenly_spread(index, total), worst = !any_ || psnr < least_;
  any_ = true;
  if (index == total / 2) cover_ = make_report_cover(name, render);
  if (worst) least_ = psnr, worst_.reset();
  if (spread) spread_.push_back(make_report_view(name, psnr, ssim, render, truth));
  if (worst && !spread) worst_ = make_report_view(name, psnr, ssim, render, truth);
}

std::vector<report_view> report_views::worst_first() const {
  std::vector<report_view> views = spread_;
  if (worst_) views.push_back(*worst_);
  std::stable_sort(views.begin(), views.end(), [](auto const& a, auto const& b) { return a.psnr < b.psnr; });
  return views;
}

std::string report_pictures(json const& m, std::vector<report_view> const& shown) {
  std::size_t const total = m.contains("views") ? m["views"].size() : 0;
  std::string html = "<h2>Test views</h2>";
  if (total == 0) {
    return html +
           "<p class=\"soft\">The capture has no test views, so nothing here tells how well the model shows "
           "other photographs.</p>";
  }
  html += "<p class=\"soft\">" +
          (shown.size() < total ? std::to_string(shown.size()) + " of " + std::to_string(total) +
                                      " views, evenly spread and the worst; all are in renders/."
                                : "All " + std::to_string(total) + ", also in renders/.") +
          " The worst comes first.</p><div class=\"heads\"><span>Render, and right of the slider the "
          "photograph</span><span>Absolute error 0<i class=\"scale\" style=\"background:" +
          error_gradient() + "\"></i>" + fixed(gart::default_error_scale, 2) + "</span></div>";
  for (auto const& v : shown) html += figure_of(v);
  return html + slide_script + all_scores(m["views"]);
}

}  // namespace gart_cli
