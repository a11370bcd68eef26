#include "history.hpp"

#include "output.hpp"

#include <gart/core/error.hpp>

#include <algorithm>

namespace gart_cli {

void history::add(gart::step_report const& report) {
  sum_.step = report.step, sum_.gaussians = report.gaussians;
  sum_.loss += report.loss, sum_.psnr += report.psnr;
  if (++pending_ >= spacing_) close_point();
}

void history::close_point() {
  if (pending_ == 0) return;
  sum_.seconds = seconds, sum_.loss /= pending_, sum_.psnr /= pending_;
  train.push_back(sum_);
  sum_ = {}, pending_ = 0;
}

nlohmann::json history::to_json() const {
  nlohmann::json all = {{"seconds", seconds},
                        {"train_columns", {"step", "seconds", "loss", "psnr", "gaussians"}},
                        {"train", nlohmann::json::array()},
                        {"test_columns", {"step", "psnr", "ssim", "seconds"}},
                        {"test", nlohmann::json::array()}};
  for (auto const& p : train) all["train"].push_back({p.step, p.seconds, p.loss, p.psnr, p.gaussians});
  for (auto const& p : test) all["test"].push_back({p.step, p.psnr, p.ssim, p.seconds});
  return all;
}

nlohmann::json history::psnr_over_seconds() const {
  nlohmann::json all = {{"test_columns", {"seconds", "step", "psnr", "ssim"}},
                        {"test", nlohmann::json::array()},
                        {"train_columns", {"seconds", "step", "psnr"}},
                        {"train", nlohmann::json::array()}};
  for (auto const& p : test) all["test"].push_back({p.seconds, p.step, p.psnr, p.ssim});
  for (auto const& p : train) all["train"].push_back({p.seconds, p.step, p.psnr});
  return all;
}

double history::seconds_at(int step) const {
  int from = 0;
  double since = 0;
  for (auto const& p : train) {
    if (p.step >= step) return since + (p.seconds - since) * (step - from) / std::max(1, p.step - from);
    from = p.step, since = p.seconds;
  }
  return since;
}

void history::restore(std::filesystem::path const& file, int step) {
  nlohmann::json const saved = read_json(file);
  auto const rows = [&](char const* key) -> nlohmann::json const& {
    if (!saved.is_object() || !saved.contains(key) || !saved[key].is_array()) {
      throw gart::io_error(file.string(), std::string("has no list \"") + key + "\"",
                           "remove it, and the report shows the resumed part of the run alone");
    }
    return saved[key];
  };
  // A loss that was not finite is null in the file, and no point of a curve. Values that no run writes are none either.
  auto const usable = [step](nlohmann::json const& row, std::size_t columns) {
    return row.is_array() && row.size() == columns &&
           std::all_of(row.begin(), row.end(), [](auto const& v) { return v.is_number(); }) &&
           row[0].get<double>() >= 0 && row[0].get<double>() <= step;
  };
  train.clear(), test.clear();
  for (auto const& row : rows("train")) {
    if (usable(row, 5) && row[1] >= 0.0 && row[4] >= 0.0) train.push_back({row[0], row[1], row[2], row[3], row[4]});
  }
  for (auto const& row : rows("test")) {
    if (usable(row, 3)) test.push_back({row[0], row[1], row[2], seconds_at(row[0])});
    if (usable(row, 4) && row[3] >= 0.0) test.push_back({row[0], row[1], row[2], row[3]});
  }
  // Of no step yet: what was measured before the first.
  seconds = !train.empty() ? train.back().seconds : rows("train").empty() ? saved.value("seconds", 0.0) : 0;
}

}  // namespace gart_cli
