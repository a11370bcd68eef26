#pragma once
// The reference for `gart tradeoff`: some pixels of some views, traced in double, and the gradient of the loss there.

#include "options.hpp"

#include <gart/io/dataset.hpp>
#include <gart/reference/reference.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gart_cli {

struct tradeoff_view {
  std::string name;
  gart::camera view;
  gart::image8 truth, mask;          // empty where there is none
  std::vector<gart::u32> pixels;     // compared; y * width + x, ascending
  gart::image_float color_gradient;  // dL/dcolour of the whole image; zero but at `pixels`
  gart::reference_image reference;
};

// `count` views, evenly spread over the training views of a capture or the cameras of a camera JSON. Of each at most
// `pixels` pixels at random (always the same ones); from the model's origin.
struct view_choice {
  int count = 2, pixels = 4096, downscale = 1;
};
struct view_set {
  std::vector<tradeoff_view> views;
  std::string background = "black";  // what suits the photographs
  float extent = 1;                  // of the scene: what Adam's steps of the means are measured in
};
view_set load_views(std::filesystem::path const& cameras, view_choice const& choice, gart::vec3d const& origin);

// Sets color_gradient: that of the training loss of `image`, the whole view, against the photograph; without one,
// random numbers.
void set_color_gradient(tradeoff_view& view, gart::image_float const& image, gart::vec3 background, float ssim_weight);
void trace_reference(tradeoff_view& view, gart::model_file const& file, gart::render_options const& options);

// An image over another, in pixels of the larger: bilinear between pixel centres, held at the borders.
gart::image_float enlarged(gart::image_float const& image, int width, int height);
// The transpose: the gradient of a smaller image from that of the one it is enlarged to.
gart::image_float gradient_of_smaller(gart::image_float const& gradient, int width, int height);

// Sums over views; the figures are of all of them together.
class error_sums {
 public:
  void add_image(tradeoff_view const& view, gart::image_float const& image);
  void add_gradients(tradeoff_view const& view, gart::gaussian_model const& got);

  double image_max() const { return image_max_; }
  double image_rms() const;
  double psnr() const;
  // Per parameter group, |difference| / |reference|. A band of SH that is not there counts as zero.
  std::map<std::string, double> gradients() const;

 private:
  struct sums {
    double error = 0, norm = 0;
  };
  double image_max_ = 0, square_ = 0;
  std::size_t values_ = 0;
  std::map<std::string, sums> groups_;
};

}  // namespace gart_cli
