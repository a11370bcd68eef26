#include "tradeoff_views.hpp"

#include "choices.hpp"
#include "loss_gradient.hpp"
#include "output.hpp"

#include <gart/core/error.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

std::vector<std::size_t> evenly_spread(std::size_t total, int count) {
  std::size_t const n = std::min(total, static_cast<std::size_t>(count));
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < n; ++i) places.push_back(i * total / n);
  return places;
}

// Uniform in [0, 1), the same with every standard library.
double uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1p-53; }

std::vector<gart::u32> sample(gart::camera const& view, int count, std::size_t seed) {
  std::vector<gart::u32> all = gart::all_pixels(view);
  if (all.size() <= static_cast<std::size_t>(count)) return all;
  std::mt19937_64 engine(seed);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    std::swap(all[i], all[i + static_cast<std::size_t>(uniform(engine) * static_cast<double>(all.size() - i))]);
  }
  all.resize(static_cast<std::size_t>(count));
  std::sort(all.begin(), all.end());
  return all;
}

// A camera JSON is a list; a capture's transforms.json is not.
bool is_camera_list(fs::path const& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && path.extension() == ".json" && read_json(path).is_array();
}

// Where pixel `i` of `to` lies between two pixels of `from`. They are the first and the second, with the share of the
// second.
struct place {
  int first, second;
  float share;
};
place place_of(int i, int from, int to) {
  float const at = std::clamp((static_cast<float>(i) + 0.5f) * static_cast<float>(from) / static_cast<float>(to) - 0.5f,
                              0.0f, static_cast<float>(from - 1));
  int const first = static_cast<int>(at);
  return {first, std::min(first + 1, from - 1), at - static_cast<float>(first)};
}

template <class F>
void each_tap(int small_width, int small_height, int width, int height, F const& f) {
  for (int y = 0; y < height; ++y) {
    place const v = place_of(y, small_height, height);
    for (int x = 0; x < width; ++x) {
      place const u = place_of(x, small_width, width);
      f(x, y, u.first, v.first, (1 - u.share) * (1 - v.share));
      f(x, y, u.second, v.first, u.share * (1 - v.share));
      f(x, y, u.first, v.second, (1 - u.share) * v.share);
      f(x, y, u.second, v.second, u.share * v.share);
    }
  }
}

}  // namespace

view_set load_views(fs::path const& cameras, view_choice const& choice, gart::vec3d const& origin) {
  view_set out;
  if (is_camera_list(cameras)) {
    auto all = gart::load_cameras(cameras);
    double farthest = 0;
    for (auto& [name, view] : all) {
      view.position -= origin;
      if (choice.downscale > 1) {
        view = gart::resized(view, std::max(1, view.width / choice.downscale),
                             std::max(1, view.height / choice.downscale));
      }
      auto const p = view.position - all.front().view.position;
      farthest = std::max(farthest, std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z));
    }
    if (farthest > 0) out.extent = static_cast<float>(farthest);
    for (std::size_t const i : evenly_spread(all.size(), choice.count)) {
      out.views.push_back({all[i].name, all[i].view, {}, {}, {}, {}, {}});
    }
  } else {
    gart::dataset_options options;
    options.downscale = choice.downscale, options.origin = origin;
    gart::dataset data = gart::load_dataset(cameras, options);
    out.background = background_for(gart::inspect(data)).value, out.extent = data.extent;
    for (std::size_t const i : evenly_spread(data.train.size(), choice.count)) {
      auto& v = data.train[i];
      out.views.push_back({v.name, v.view, std::move(v.image), std::move(v.mask), {}, {}, {}});
    }
  }
  if (out.views.empty()) throw gart::io_error(cameras.string(), "has no cameras", "name a dataset or a camera JSON");
  for (std::size_t i = 0; i < out.views.size(); ++i) {
    out.views[i].pixels = sample(out.views[i].view, choice.pixels, i + 1);
  }
  return out;
}

void set_color_gradient(tradeoff_view& v, gart::image_float const& image, gart::vec3 background, float ssim_weight) {
  gart::image_float whole(v.view.width, v.view.height, 3);
  if (v.truth.empty()) {
    std::mt19937_64 engine(0);
    for (float& x : whole.data)
      x = static_cast<float>((2 * uniform(engine) - 1) / static_cast<double>(whole.data.size()));
  } else {
    whole = loss_gradient(image, v.truth, v.mask, background, ssim_weight);
  }
  v.color_gradient = gart::image_float(v.view.width, v.view.height, 3);
  for (std::size_t const p : v.pixels) std::copy_n(&whole.data[3 * p], 3, &v.color_gradient.data[3 * p]);
}

void trace_reference(tradeoff_view& v, gart::model_file const& file, gart::render_options const& options) {
  std::vector<double> gradient;
  for (std::size_t const p : v.pixels)
    for (int c = 0; c < 3; ++c) gradient.push_back(v.color_gradient.data[3 * p + c]);
  v.reference =
      gart::trace_reference(file.model, v.view, options, file.model.sh_degree, v.pixels, gradient, file.kernel_degree);
}

gart::image_float enlarged(gart::image_float const& image, int width, int height) {
  gart::image_float out(width, height, 3);
  each_tap(image.width, image.height, width, height, [&](int x, int y, int u, int v, float weight) {
    for (int c = 0; c < 3; ++c) out.at(x, y, c) += weight * image.at(u, v, c);
  });
  return out;
}

gart::image_float gradient_of_smaller(gart::image_float const& gradient, int width, int height) {
  gart::image_float out(width, height, 3);
  each_tap(width, height, gradient.width, gradient.height, [&](int x, int y, int u, int v, float weight) {
    for (int c = 0; c < 3; ++c) out.at(u, v, c) += weight * gradient.at(x, y, c);
  });
  return out;
}

void error_sums::add_image(tradeoff_view const& v, gart::image_float const& image) {
  for (std::size_t k = 0; k < v.pixels.size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      double const error = std::abs(image.data[3 * std::size_t{v.pixels[k]} + c] - v.reference.color[3 * k + c]);
      // A NaN is as wrong as can be, and must not vanish in a maximum.
      image_max_ = error <= image_max_ ? image_max_ : std::isnan(error) ? INFINITY : error;
      square_ += error * error;
    }
  }
  values_ += 3 * v.pixels.size();
}

void error_sums::add_gradients(tradeoff_view const& v, gart::gaussian_model const& got) {
  auto const& expected = v.reference.gradients;
  auto const add = [&](char const* name, std::vector<float> const& a, std::vector<double> const& b, std::size_t row_a,
                       std::size_t row_b) {
    sums& s = groups_[name];
    for (std::size_t i = 0; i < b.size(); ++i) {
      std::size_t const at = i % row_b;
      double const error = (at < row_a ? a[i / row_b * row_a + at] : 0.0) - b[i];
      s.error += error * error, s.norm += b[i] * b[i];
    }
  };
  add("mean", got.mean, expected.mean, 3, 3);
  add("log_scale", got.log_scale, expected.log_scale, 3, 3);
  add("quaternion", got.quaternion, expected.quaternion, 4, 4);
  add("opacity", got.opacity, expected.opacity, 1, 1);
  add("sh", got.sh, expected.sh, std::size_t{3} * gart::sh_coefficients(got.sh_degree),
      std::size_t{3} * gart::sh_coefficients(expected.sh_degree));
}

double error_sums::image_rms() const { return values_ ? std::sqrt(square_ / static_cast<double>(values_)) : 0; }
double error_sums::psnr() const { return -20 * std::log10(image_rms()); }

std::map<std::string, double> error_sums::gradients() const {
  std::map<std::string, double> out;
  for (auto const& [name, s] : groups_) out[name] = s.norm > 0 ? std::sqrt(s.error / s.norm) : std::sqrt(s.error);
  return out;
}

}  // namespace gart_cli
