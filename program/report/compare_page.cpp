#include "compare_page.hpp"

#include "output.hpp"
#include "page_parts.hpp"
#include "progress.hpp"
#include "svg_chart.hpp"

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t most_views = 12;

compared_run read_run(fs::path const& folder) {
  if (!fs::exists(folder / "metrics.json") || !fs::exists(folder / "config.json")) {
    throw gart::io_error(folder.string(), "is no folder of a finished training",
                         "name the --out of gart train; gart train --resume finishes one that was stopped");
  }
  compared_run run{folder, "", read_json(folder / "metrics.json"), {}};
  json const config = read_json(folder / "config.json");
  if (!run.metrics.is_object() || !config.is_object())
    throw gart::io_error(folder.string(), "metrics.json and config.json are no JSON objects", "train it again");
  run.options = config.value("options", json::object());
  if (!run.options.is_object())
    throw gart::io_error((folder / "config.json").string(), "\"options\" is no JSON object", "train it again");
  if (fs::exists(folder / "history.json")) run.course.restore(folder / "history.json", std::numeric_limits<int>::max());
  return run;
}

// As few of the last parts of the paths as tell them apart.
void name_runs(std::vector<compared_run>& runs) {
  for (std::size_t parts = 1; parts < 64; ++parts) {
    std::set<std::string> names;
    for (compared_run& run : runs) {
      fs::path path = fs::absolute(run.folder).lexically_normal(), name;
      if (!path.has_filename()) path = path.parent_path();
      for (std::size_t i = 0; i < parts && path.has_relative_path(); ++i, path = path.parent_path())
        name = name.empty() ? path.filename() : path.filename() / name;
      run.name = name.string();
      names.insert(run.name);
    }
    if (names.size() == runs.size()) return;
  }
}

std::string heads(std::vector<compared_run> const& runs, char const* first) {
  std::string html = std::string("<tr><th>") + first + "</th>";
  for (std::size_t i = 0; i < runs.size(); ++i) {
    html += "<th class=\"n\"><span class=\"key\"><i class=\"swatch-" + std::to_string(i + 1) + "\"></i></span>" +
            html_escape(runs[i].name) + "</th>";
  }
  return html + "</tr>";
}

std::string figures_row(std::vector<compared_run> const& runs, char const* name, char const* key, int better,
                        std::string (*show)(double)) {
  std::vector<double> values;
  for (auto const& run : runs) values.push_back(number_of(run.metrics, key));
  double best = std::nan("");
  for (double const v : values)
    if (std::isfinite(v) && (!std::isfinite(best) || better * v > better * best)) best = v;
  if (!std::isfinite(best)) return "";
  std::string html = std::string("<tr><td>") + name + "</td>";
  bool const all_same = std::all_of(values.begin(), values.end(), [&](double v) { return v == best; });
  for (double const v : values) {
    bool const marked = better != 0 && v == best && !all_same;
    std::string const text = std::isfinite(v) ? show(v) : "-";
    html += "<td class=\"n\">" + (marked ? "<b>" + text + "</b>" : text) + "</td>";
  }
  return html + "</tr>";
}

std::string scores_table(std::vector<compared_run> const& runs) {
  auto const two = [](double v) { return fixed(v, 2); };
  auto const four = [](double v) { return fixed(v, 4); };
  auto const whole = [](double v) { return with_commas(static_cast<std::uint64_t>(std::max(v, 0.0))); };
  return "<h2>Scores</h2><div class=\"box wide\"><table>" + heads(runs, "") +
         figures_row(runs, "Test PSNR, dB", "psnr", 1, two) + figures_row(runs, "Test SSIM", "ssim", 1, four) +
         figures_row(runs, "PSNR after affine colour, dB", "psnr_affine_colour", 0, two) +
         figures_row(runs, "Training time", "seconds", -1, as_duration) +
         figures_row(runs, "Iterations", "iterations", 0, whole) +
         figures_row(runs, "Iterations a second", "iterations_per_second", 0, two) +
         figures_row(runs, "Gaussians", "gaussians", 0, whole) +
         figures_row(runs, "Model", "model_bytes", -1, as_bytes) +
         figures_row(runs, "Peak memory of the backend", "peak_bytes", -1, as_bytes) +
         "</table></div><p class=\"soft\">Bold: the best of a row.</p>";
}

std::string differences_table(std::vector<compared_run> const& runs) {
  auto const rows = differences(runs);
  std::string html = "<h2>What differed</h2>";
  if (rows.empty()) return html + "<p class=\"soft\">No option did.</p>";
  html += "<div class=\"box wide\"><table>" + heads(runs, "");
  for (difference const& row : rows) {
    html += "<tr><td>" + html_escape(row.name) + "</td>";
    for (auto const& value : row.values) html += "<td class=\"n\">" + html_escape(value) + "</td>";
    html += "</tr>";
  }
  return html + "</table></div><p class=\"soft\">All other options were the same.</p>";
}

std::string curves(std::vector<compared_run> const& runs) {
  chart steps{"Test PSNR", "dB", "iterations", {}, false, 0, false},
      times{"Test PSNR over training time", "dB", "seconds", {}, false, 0, false};
  chart loss{"Training loss", "", "iterations", {}, true, 0, false},
      count{"Gaussians", "", "iterations", {}, false, 0, true, true};
  for (auto const& run : runs) {
    for (chart* c : {&steps, &times}) c->series.push_back({run.name, {}, true});
    for (chart* c : {&loss, &count}) c->series.push_back({run.name, {}, false});
    for (auto const& p : run.course.test) {
      steps.series.back().points.emplace_back(p.step, p.psnr);
      times.series.back().points.emplace_back(p.seconds, p.psnr);
    }
    for (auto const& p : run.course.train) {
      loss.series.back().points.emplace_back(p.step, p.loss);
      count.series.back().points.emplace_back(p.step, p.gaussians);
    }
  }
  std::string const plots = to_svg(steps) + to_svg(times) + to_svg(loss) + to_svg(count);
  return plots.empty() ? "" : "<h2>Course of the trainings</h2><section class=\"charts\">" + plots + "</section>";
}

struct shared_view {
  std::string name;
  std::vector<double> psnr;
  double spread = 0;
};

// Test views that all runs have, those first on which the runs differ most.
std::vector<shared_view> shared_views(std::vector<compared_run> const& runs) {
  std::vector<shared_view> views;
  auto const views_of = [](compared_run const& run) { return run.metrics.value("views", json::array()); };
  auto const name_of = [](json const& v) { return v.is_object() ? v.value("name", "") : std::string(); };
  for (auto const& first : views_of(runs[0])) {
    shared_view view{name_of(first), {}};
    if (view.name.empty() || fs::path(view.name).filename() != view.name) continue;
    for (auto const& run : runs) {
      for (auto const& v : views_of(run)) {
        if (name_of(v) != view.name) continue;
        view.psnr.push_back(number_of(v, "psnr"));
        break;
      }
    }
    if (view.psnr.size() != runs.size()) continue;
    auto const [low, high] = std::minmax_element(view.psnr.begin(), view.psnr.end());
    view.spread = std::isfinite(*high - *low) ? *high - *low : 0;
    views.push_back(view);
  }
  std::stable_sort(views.begin(), views.end(), [](auto const& a, auto const& b) { return a.spread > b.spread; });
  return views;
}

std::string pictures(std::vector<compared_run> const& runs) {
  auto const views = shared_views(runs);
  std::string html = "<h2>Test views</h2>";
  if (views.empty()) return html + "<p class=\"soft\">The runs have no test view in common.</p>";
  std::size_t const shown = std::min(views.size(), most_views);
  html +=
      "<p class=\"soft\">" +
      (shown < views.size() ? std::to_string(shown) + " of the " + std::to_string(views.size()) + " that all runs have"
                            : std::to_string(shown) + ", all that all runs have") +
      "; first those on which the runs differ most.</p>";
  for (std::size_t i = 0; i < shown; ++i) {
    shared_view const& view = views[i];
    std::string const name = html_escape(view.name);
    auto const picture = [&](fs::path const& file, std::string const& caption) {
      return "<figure>" + page_image(page_jpeg(gart::read_image(file)), name + ", " + caption) + "<figcaption>" +
             caption + "</figcaption></figure>";
    };
    html += "<section class=\"view\"><h3>" + name + "</h3><div class=\"side\">";
    for (std::size_t k = 0; k < runs.size(); ++k) {
      html += picture(runs[k].folder / "renders" / (view.name + ".png"),
                      html_escape(runs[k].name) + ", " + fixed(view.psnr[k], 2) + " dB");
    }
    html += picture(runs[0].folder / "renders" / (view.name + "_truth.png"), "photograph") + "</div></section>";
  }
  return html;
}

}  // namespace

std::vector<compared_run> read_runs(std::vector<fs::path> const& folders) {
  std::vector<compared_run> runs;
  for (fs::path const& folder : folders) {
    for (compared_run const& other : runs)
      if (fs::equivalent(other.folder, folder))
        throw gart::io_error(folder.string(), "is there twice", "name each run once");
    runs.push_back(read_run(folder));
  }
  name_runs(runs);
  return runs;
}

std::vector<difference> differences(std::vector<compared_run> const& runs) {
  std::vector<difference> rows;
  auto const add = [&](std::string const& name, auto const& value_of) {
    difference row{name, {}};
    for (auto const& run : runs) row.values.push_back(value_of(run));
    if (std::any_of(row.values.begin(), row.values.end(), [&](auto const& v) { return v != row.values[0]; }))
      rows.push_back(row);
  };
  std::set<std::string> names;
  for (auto const& run : runs)
    for (auto const& [name, value] : run.options.items()) names.insert(name);
  for (char const* key : {"scene", "split", "image_size", "train_views", "test_views", "sh_degree"}) {
    add(key, [&](compared_run const& run) {
      return run.metrics.contains(key) ? in_words(run.metrics[key]) : std::string("-");
    });
  }
  for (auto const& name : names) {
    add("--" + name, [&](compared_run const& run) {
      return run.options.contains(name) ? in_words(run.options[name]) : std::string("-");
    });
  }
  return rows;
}

std::string compare_page(std::vector<compared_run> const& runs) {
  std::string title, scene = text_of(runs[0].metrics, "scene");
  for (auto const& run : runs) {
    title += (title.empty() ? "" : ", ") + html_escape(run.name);
    if (text_of(run.metrics, "scene") != scene) scene.clear();
  }
  return page_start(title) + "<header><h1>" + title + "</h1><p class=\"soft\">" + std::to_string(runs.size()) +
         " trainings" +
         (scene.empty() ? ", not all on one capture: their scores are of different photographs" : " on " + scene) +
         ".</p></header>" + scores_table(runs) + differences_table(runs) + curves(runs) + pictures(runs) + page_end();
}

}  // namespace gart_cli
