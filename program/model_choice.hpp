#pragma once
// The models that a viewer may open in place of its first one, and the scores in their runs' files.

#include <gart/io/dataset.hpp>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace gart_cli {

// Finds models by their endings, in the model's folder. For a run's model also those of the runs beside it.
class model_choice {
 public:
  explicit model_choice(std::filesystem::path const& model);
  int first() const { return first_; }  // the one it was made for
  std::filesystem::path const& path(int i) const { return paths_.at(static_cast<std::size_t>(i)); }
  std::vector<std::string> const& names() const { return names_; }

 private:
  std::vector<std::filesystem::path> paths_;
  std::vector<std::string> names_;
  int first_ = 0;
};

// PSNR of views, by their index in the capture (training views first), from the metrics.json beside a model. Empty
// without such a file, or if its views have other names.
std::vector<std::pair<int, double>> scores_of_run(std::filesystem::path const& model, gart::dataset const& data);

}  // namespace gart_cli
