#include "tradeoff_page.hpp"

#include "progress.hpp"
#include "report/page_parts.hpp"
#include "report/svg_chart.hpp"
#include "report/svg_scatter.hpp"

#include <gart/core/words.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

namespace gart_cli {

namespace {

using nlohmann::json;

double number(json const& value) { return value.is_number() ? value.get<double>() : INFINITY; }

double image_error(json const& s) { return number(s["image"]["rms"]); }
bool by_processor(json const& result) { return result["clock"] == "processor"; }
double time_of(json const& result, json const& s) {
  return number(s[by_processor(result) ? "processor_ms" : "total_ms"]);
}
double gradient_error(json const& s) { return number(s["gradient_worst"]); }

// "1.2e-05": errors span many decades.
std::string small(json const& value) {
  if (!value.is_number()) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", value.get<double>());
  return text;
}

std::string decimals(json const& value, int count) {
  return value.is_number() ? fixed(value.get<double>(), count) : "-";
}

std::string milliseconds(json const& value) {
  double const ms = number(value);
  return fixed(ms, ms < 10 ? 2 : ms < 100 ? 1 : 0);
}

using row = std::vector<std::string>;

row const heads = {"setting", "image max", "PSNR, dB", "mean",      "scale",     "rotation",  "opacity", "sh",
                   "prepare", "forward",   "backward", "total, ms", "processor", "hit slots", "peak",    "file"};

row cells_of(json const& s) {
  row out{s["name"].get<std::string>(), small(s["image"]["max"]), decimals(s["image"]["psnr"], 1)};
  for (char const* group : tradeoff_groups) out.push_back(small(s["gradients"][group]));
  for (char const* stage : {"prepare_ms", "forward_ms", "backward_ms", "total_ms", "processor_ms"})
    out.push_back(milliseconds(s[stage]));
  out.push_back(number(s["hit_buffer_bytes"]) > 0 ? as_bytes(number(s["hit_buffer_bytes"])) : "-");
  out.push_back(as_bytes(number(s["peak_bytes"])));
  out.push_back(s["file_bytes"].is_number() ? as_bytes(number(s["file_bytes"])) : "-");
  return out;
}

std::string reference_of(json const& result) {
  char text[160];
  std::snprintf(text, sizeof text, "the reference in double (alpha_min %.3g, transmittance_min %.3g)",
                number(result["reference"]["alpha_min"]), number(result["reference"]["transmittance_min"]));
  return text;
}

std::string subject_of(json const& r) {
  return r["model"].get<std::string>() + ", " + with_commas(r["gaussians"].get<std::uint64_t>()) + " Gaussians, " +
         std::to_string(r["width"].get<int>()) + " x " + std::to_string(r["height"].get<int>()) + " pixels, " +
         r["backend"].get<std::string>() + " backend";
}

std::string method_of(json const& r) {
  return "Errors against " + reference_of(r) + " over " + with_commas(r["pixels"].get<std::uint64_t>()) +
         " pixels of " + gart::counted(r["views"].size(), "view") + "; gradients of " +
         r["gradient_of"].get<std::string>() + ", each parameter group's |error| / |reference|. Times: medians of " +
         std::to_string(r["repeats"].get<int>()) +
         ", mean over the views, of the forward and the backward pass and what prepares them.";
}

bool on_front(json const& s, char const* which) { return s["front"][which].get<bool>(); }

std::string figure_of(json const& result, char const* front, char const* title, char const* error_label,
                      double (*error)(json const&)) {
  scatter plot{
      title,
      by_processor(result) ? "forward and backward, ms of all threads a view" : "forward and backward, ms a view",
      error_label,
      {}};
  for (json const& s : result["settings"]) {
    plot.points.push_back({time_of(result, s), error(s), s["name"].get<std::string>(), on_front(s, front)});
  }
  return to_svg(plot);
}

std::string table_of(json const& settings) {
  std::string html = "<div class=\"wide\"><table><tr>";
  for (std::size_t i = 0; i < heads.size(); ++i)
    html += std::string(i ? "<th class=\"n\">" : "<th>") + heads[i] + "</th>";
  html += "</tr>";
  for (json const& s : settings) {
    bool const front = on_front(s, "image") || on_front(s, "gradients");
    html += front ? "<tr>" : "<tr class=\"dim\">";
    row const cells = cells_of(s);
    for (std::size_t i = 0; i < cells.size(); ++i)
      html += std::string(i ? "<td class=\"n\">" : "<td>") + html_escape(cells[i]) + "</td>";
    html += "</tr>";
  }
  return html + "</table></div>";
}

void mark(json& result, char const* which, double (*error)(json const&)) {
  json& settings = result["settings"];
  for (json& s : settings) {
    s["front"][which] = std::none_of(settings.begin(), settings.end(), [&](json const& other) {
      double const t = time_of(result, s), other_t = time_of(result, other), e = error(s), other_e = error(other);
      return other_t <= t && other_e <= e && (other_t < t || other_e < e);
    });
  }
}

}  // namespace

void mark_fronts(json& result) {
  mark(result, "image", image_error);
  mark(result, "gradients", gradient_error);
}

std::string tradeoff_table(json const& result) {
  std::vector<row> rows{heads};
  rows[0].insert(rows[0].begin(), "");
  for (json const& s : result["settings"]) {
    rows.push_back(cells_of(s));
    std::string const marks = std::string(on_front(s, "image") ? "i" : "") + (on_front(s, "gradients") ? "g" : "");
    rows.back().insert(rows.back().begin(), marks);
  }
  std::vector<std::size_t> widths(rows[0].size());
  for (row const& r : rows)
    for (std::size_t i = 0; i < r.size(); ++i) widths[i] = std::max(widths[i], r[i].size());
  std::string text = subject_of(result) + "\n";
  for (row const& r : rows) {
    for (std::size_t i = 0; i < r.size(); ++i) {
      std::string const space(widths[i] - r[i].size(), ' ');
      text += (i ? "  " : "") + (i < 2 ? r[i] + space : space + r[i]);
    }
    text += "\n";
  }
  text += "i, g: on the front of image, of gradient error against time.\n" + method_of(result) + "\n";
  for (json const& absent : result["absent"])
    text += "absent  " + absent["name"].get<std::string>() + ": not compiled here\n";
  return text;
}

std::string tradeoff_page(json const& result) {
  json const& settings = result["settings"];
  std::string const title = "What speed costs: " + html_escape(result["cameras"].get<std::string>());
  std::string page = page_start(title) + "<header><h1>" + title + "</h1><p class=\"soft\">" +
                     html_escape(subject_of(result)) +
                     ". A setting that another one beats in error and in time is grey.</p></header>";
  // No figure is made of a single setting.
  auto const add = [&page](char const* heading, std::string const& figure) {
    if (!figure.empty()) page += std::string("<h2>") + heading + "</h2>" + figure;
  };
  add("Image", figure_of(result, "image", "Error of the image against time",
                         "root mean square error of the colour, 0 to 1", image_error));
  add("Gradients", figure_of(result, "gradients", "Error of the gradients against time",
                             "relative error of the worst parameter group", gradient_error));
  page += "<h2>Every setting</h2>" + table_of(settings);
  page += "<h2>How it was measured</h2><p>" + html_escape(method_of(result)) + "</p>";
  if (!result["absent"].empty()) {
    page += "<h2>Not compiled here</h2><p class=\"soft\">";
    for (json const& absent : result["absent"])
      page += html_escape(absent["name"].get<std::string>()) + (absent == result["absent"].back() ? "." : ", ");
    page += "</p>";
  }
  return page + page_end();
}

}  // namespace gart_cli
