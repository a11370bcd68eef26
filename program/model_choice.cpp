#include "model_choice.hpp"

#include <gart/io/splat_file.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <map>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t most = 200;

bool is_splats(fs::path const& file) {
  std::string const name = file.filename().string();
  auto const formats = gart::splat_formats();
  return std::any_of(formats.begin(), formats.end(),
                     [&](gart::splat_format const* one) { return name.ends_with(one->extension); });
}

// In a folder that may not be there or not be read; by name.
std::vector<fs::path> inside(fs::path const& folder, auto const& wanted) {
  std::vector<fs::path> found;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code))
    if (wanted(*at)) found.push_back(at->path());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

model_choice::model_choice(fs::path const& model) {
  fs::path const own = fs::absolute(model).lexically_normal(), folder = own.parent_path();
  std::error_code code;
  std::vector<fs::path> all =
      inside(folder, [&](fs::directory_entry const& e) { return e.is_regular_file(code) && is_splats(e.path()); });
  if (fs::exists(folder / "config.json", code))
    for (fs::path const& run : inside(folder.parent_path(), [&](auto const& e) { return e.is_directory(code); }))
      if (run != folder && fs::is_regular_file(run / "model.ply", code)) all.push_back(run / "model.ply");
  std::erase(all, own);
  all.insert(all.begin(), own);
  all.resize(std::min(all.size(), most));
  for (fs::path const& path : all) {
    paths_.push_back(path);
    names_.push_back(path.parent_path() == folder ? path.filename().string()
                                                  : path.lexically_relative(folder.parent_path()).string());
  }
}

std::vector<std::pair<int, double>> scores_of_run(fs::path const& model, gart::dataset const& data) {
  std::ifstream file(model.parent_path() / "metrics.json");
  nlohmann::json const metrics = nlohmann::json::parse(file, nullptr, false);
  std::map<std::string, double> by_name;
  if (metrics.is_object() && metrics.contains("views") && metrics["views"].is_array())
    for (auto const& view : metrics["views"])
      if (view.is_object() && view.contains("name") && view["name"].is_string() && view.contains("psnr") &&
          view["psnr"].is_number())
        by_name[view["name"]] = view["psnr"];
  std::vector<std::pair<int, double>> scores;
  for (std::size_t i = 0; i < data.test.size(); ++i)
    if (auto const found = by_name.find(data.test[i].name); found != by_name.end())
      scores.emplace_back(static_cast<int>(data.train.size() + i), found->second);
  return scores;
}

}  // namespace gart_cli
