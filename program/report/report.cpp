#include "report.hpp"

#include "page_parts.hpp"
#include "progress.hpp"
#include "svg_chart.hpp"

#include <algorithm>
#include <cmath>

namespace gart_cli {

namespace {

using nlohmann::json;

std::string headline(std::string const& value, std::string const& unit, std::string const& label) {
  return "<div><b>" + value + (unit.empty() ? "" : "<small>" + unit + "</small>") + "</b><span>" + label +
         "</span></div>";
}

std::string figures(json const& m) {
  bool const tested = std::isfinite(number_of(m, "psnr"));
  std::string html = "<section class=\"figures\">";
  if (tested) {
    html += headline(fixed(number_of(m, "psnr"), 2), "dB", "Test PSNR");
    html += headline(fixed(number_of(m, "ssim"), 4), "", "Test SSIM");
  }
  html += headline(count_of(m, "gaussians"), "", "Gaussians");
  html += headline(as_duration(number_of(m, "seconds")), "", "Training time");
  html += headline(fixed(number_of(m, "iterations_per_second"), 1), "/s", "Iterations");
  html +=
      headline(as_bytes(number_of(m, "peak_bytes")), "", "Peak memory of the " + text_of(m, "backend") + " backend");
  return html + "</section>";
}

std::string comparison(json const& m) {
  if (!m.contains("training_scores") || !std::isfinite(number_of(m, "psnr"))) return "";
  std::string html =
      "<h2>Scores</h2><div class=\"box\"><table><tr><th>Views</th><th class=\"n\">PSNR, dB</th><th "
      "class=\"n\">SSIM</th><th class=\"n\">PSNR after affine colour, dB</th></tr>";
  auto const row = [&](std::string const& name, json const& s) {
    html += "<tr><td>" + name + "</td><td class=\"n\">" + fixed(number_of(s, "psnr"), 2) + "</td><td class=\"n\">" +
            fixed(number_of(s, "ssim"), 4) + "</td><td class=\"n\">" + fixed(number_of(s, "psnr_affine_colour"), 2) +
            "</td></tr>";
  };
  row("Test, " + count_of(m, "test_views"), m);
  json const& training = m["training_scores"];
  row("Training, " + count_of(training, "scored_views") + " of " + count_of(m, "train_views") + ", evenly spread",
      training);
  return html +
         "</table></div><p class=\"soft\">The last column is a diagnostic, not a score: PSNR after the affine map of "
         "colours that brings each render nearest to its photograph. It tells how much of the error is "
         "exposure and white balance.</p>";
}

std::string curves(history const& course, double iterations) {
  chart loss{"Training loss", "", "iterations", {{"", {}, false}}, true, iterations, false};
  chart psnr{"PSNR", "dB", "iterations", {{"training view", {}, false}, {"test", {}, true}}, false, iterations, false};
  chart ssim{"Test SSIM", "", "iterations", {{"", {}, true}}, false, iterations, false};
  chart count{"Gaussians", "", "iterations", {{"", {}, false}}, false, iterations, true, true};
  chart timed{"PSNR over training time",
              "dB",
              "seconds",
              {{"training view", {}, false}, {"test", {}, true}},
              false,
              course.seconds,
              false};
  for (auto const& p : course.train) {
    timed.series[0].points.emplace_back(p.seconds, p.psnr);
    loss.series[0].points.emplace_back(p.step, p.loss);
    psnr.series[0].points.emplace_back(p.step, p.psnr);
    count.series[0].points.emplace_back(p.step, p.gaussians);
  }
  for (auto const& p : course.test) {
    timed.series[1].points.emplace_back(p.seconds, p.psnr);
    psnr.series[1].points.emplace_back(p.step, p.psnr);
    ssim.series[0].points.emplace_back(p.step, p.ssim);
  }
  std::string const plots = to_svg(psnr) + to_svg(timed) + to_svg(loss) + to_svg(count) + to_svg(ssim);
  return plots.empty() ? "" : "<h2>Course of the training</h2><section class=\"charts\">" + plots + "</section>";
}

std::string bars(std::vector<std::pair<std::string, double>> rows, std::string const& unit, double whole) {
  std::sort(rows.begin(), rows.end(), [](auto const& a, auto const& b) { return a.second > b.second; });
  std::string html = "<table>";
  for (auto const& [name, value] : rows) {
    double const share = whole > 0 ? std::clamp(value / whole, 0.0, 1.0) : 0;
    html += "<tr><td>" + html_escape(name) + "</td><td class=\"n\">" + fixed(value, value < 10 ? 3 : 1) + " " + unit +
            "</td><td class=\"n\">" + fixed(100 * share, 1) +
            " %</td><td class=\"bar\"><i style=\"width:" + fixed(100 * share, 1) + "%\"></i></td></tr>";
  }
  return html + "</table>";
}

std::vector<std::pair<std::string, double>> rows_of(json const& all, char const* key, double* sum) {
  std::vector<std::pair<std::string, double>> rows;
  if (!all.contains(key)) return rows;
  for (auto const& [name, value] : all[key].items()) {
    rows.emplace_back(name, value.is_number() ? value.get<double>() : 0);
    *sum += rows.back().second;
  }
  return rows;
}

std::string costs(json const& m) {
  double stages = 0, phases = 0;
  auto const stage_rows = rows_of(m, "stages_ms", &stages), phase_rows = rows_of(m, "wall_seconds", &phases);
  double const step = number_of(m, "profiled_step_ms");
  std::string html = "<h2>Where the time and memory went</h2>";
  if (!stage_rows.empty()) {
    html += "<p class=\"soft\">Stages of a training step, the mean of " + count_of(m, "profiled_steps") +
            " steps that were timed; such a step took " + fixed(step, 2) +
            " ms. A stage that contains others is counted with them.</p><div class=\"box\">" +
            bars(stage_rows, "ms", std::isfinite(step) ? step : stages) + "</div>";
  }
  html += "<p class=\"soft\">The run as a whole.</p><div class=\"box\">" + bars(phase_rows, "s", phases) + "</div>";
  html += "<p>Buffers of the " + text_of(m, "backend") + " backend held " + as_bytes(number_of(m, "peak_bytes")) +
          " at most; the process held " + as_bytes(number_of(m, "peak_process_bytes")) +
          " of host memory, images included.</p>";
  return html;
}

std::string choices(json const& m) {
  if (!m.contains("chosen") || m["chosen"].empty()) return "";
  std::string html = "<h2>Chosen for this capture</h2><div class=\"box\"><table>";
  for (auto const& c : m["chosen"]) {
    html += "<tr><td>" + text_of(c, "option") + "</td><td><b>" + text_of(c, "value") + "</b></td><td>" +
            text_of(c, "why") + "</td></tr>";
  }
  html += "</table></div>";
  if (!m.contains("measured") || m["measured"].value("trials", json::array()).empty()) return html;
  json const& measured = m["measured"];
  html += "<p class=\"soft\">Tried before the run: " + text_of(measured, "why") +
          ". PSNR is of these. A gain counts above its noise, where nothing else is said."
          "</p><div class=\"box\"><table><tr><th>Setting</th><th>Value</th><th class=\"n\">PSNR, dB</th>"
          "<th class=\"n\">gain, dB</th><th></th></tr>";
  for (auto const& t : measured["trials"]) {
    bool const first = text_of(t, "setting").empty();
    std::string const why = text_of(t, "why");
    html += "<tr><td>" + (first ? "as they come" : text_of(t, "setting")) + "</td><td>" + text_of(t, "value") +
            "</td><td class=\"n\">" + fixed(number_of(t, "psnr"), 3) + "</td><td class=\"n\">" +
            (first ? "" : fixed(number_of(t, "gain"), 3) + " &plusmn; " + fixed(number_of(t, "noise"), 3)) +
            "</td><td>" +
            (first                     ? ""
             : t.value("taken", false) ? "taken"
                                       : "left") +
            (why.empty() ? "" : ": " + why) + "</td></tr>";
  }
  return html + "</table></div>";
}

std::string settings(json const& m, json const& config) {
  std::string html = "<h2>Settings</h2><div class=\"settings\">";
  auto const row = [&](std::string const& name, std::string const& value) {
    if (value.empty()) return;
    html += "<div><span>" + html_escape(name) + "</span><b>" + html_escape(value) + "</b></div>";
  };
  json const options = config.value("options", json::object());
  for (auto const& [name, value] : options.items()) row("--" + name, in_words(value));
  double const max_hits = number_of(m["approximations"], "max_hits");
  std::string cap = max_hits > 0 ? " or after " + fixed(max_hits, 0) + " hits" : "";
  if (text_of(m["approximations"], "adam") == "seen")
    cap += "; each step moved only the Gaussians that its view showed";
  html += "</div><h2>How it was measured</h2><p>Split: " + text_of(m, "split") + "; " + count_of(m, "test_views") +
          " test views. Images resized: " + text_of(m, "resize_filter") + ". Background: " + text_of(m, "background") +
          ". Approximations: preset " + text_of(m["approximations"], "preset") +
          "; a Gaussian is hit where its alpha is at least " + fixed(number_of(m["approximations"], "alpha_min"), 6) +
          ", and a ray ends below a transmittance of " + fixed(number_of(m["approximations"], "transmittance_min"), 6) +
          cap +
          ". PSNR and SSIM (11 x 11 Gaussian window, sigma 1.5) are taken per view on [0, 1] and averaged over views.";
  if (m.contains("psnr_own_colours")) {
    html += m.value("exposure", false)
                ? " Each test view has the exposure of the training views about it, not of its own photograph"
                : " Each test view is darker towards its corners, by the falloff learned on the training views";
    html += "; without, in the scene's own colours, PSNR is " + fixed(number_of(m, "psnr_own_colours"), 2) + " dB.";
  }
  html += "</p>";
  if (m.contains("notes") && !m["notes"].empty()) {
    html += "<p class=\"soft\">Of the capture: ";
    for (auto const& note : m["notes"])
      html += html_escape(note.get<std::string>()) + (note == m["notes"].back() ? "" : "; ");
    html += ".</p>";
  }
  return html;
}

}  // namespace

std::string report_page(json const& metrics, json const& config, history const& course, report_cover const& cover,
                        std::vector<report_view> const& views) {
  std::string const title = text_of(metrics, "scene");
  std::string page = page_start(title);
  page += "<header><h1>" + title + "</h1><p class=\"soft\">" + text_of(metrics, "format") + " capture, " +
          count_of(metrics, "train_views") + " training views of " + text_of(metrics, "image_size") + " pixels. " +
          count_of(metrics, "iterations") + " iterations with the " + text_of(metrics, "backend") + " backend, the " +
          text_of(metrics, "tracer") + " tracer and the " + text_of(metrics, "backward") +
          " backward pass.</p></header>";
  if (!cover.jpeg.empty()) {
    std::string const name = html_escape(cover.name);
    page += "<figure class=\"cover\">" + page_image(cover.jpeg, name + ", render", true) + "<figcaption>" + name +
            ", as the model shows it</figcaption></figure>";
  }
  page += figures(metrics);
  page += comparison(metrics);
  page += curves(course, number_of(metrics, "iterations"));
  page += report_pictures(metrics, views);
  page += costs(metrics);
  page += choices(metrics);
  page += settings(metrics, config);
  return page + page_end();
}

}  // namespace gart_cli
