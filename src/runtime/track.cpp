#include <gart/camera/models.hpp>
#include <gart/core/error.hpp>
#include <gart/runtime/track.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace gart {

namespace {

constexpr int numbers = 6;
using vec6 = std::array<double, numbers>;
using mat6 = std::array<vec6, numbers>;

// A box of 2 r + 1 pixels along an axis, with zeros beyond the border. It is its own adjoint.
void box(image_float& image, int r, bool across) {
  int const lines = across ? image.height : image.width, length = across ? image.width : image.height;
  std::size_t const step =
      static_cast<std::size_t>(image.channels) * (across ? 1 : static_cast<std::size_t>(image.width));
  std::size_t const next =
      static_cast<std::size_t>(image.channels) * (across ? static_cast<std::size_t>(image.width) : 1);
  float const share = 1.0f / static_cast<float>(2 * r + 1);
  std::vector<float> line(static_cast<std::size_t>(length));
  for (int l = 0; l < lines; ++l)
    for (int c = 0; c < image.channels; ++c) {
      float* const at = image.data.data() + static_cast<std::size_t>(l) * next + c;
      for (int k = 0; k < length; ++k) line[static_cast<std::size_t>(k)] = at[static_cast<std::size_t>(k) * step];
      double sum = 0;
      for (int k = 0; k < std::min(r, length); ++k) sum += double{line[static_cast<std::size_t>(k)]};
      for (int k = 0; k < length; ++k) {
        if (k + r < length) sum += double{line[static_cast<std::size_t>(k + r)]};
        if (k - r - 1 >= 0) sum -= double{line[static_cast<std::size_t>(k - r - 1)]};
        at[static_cast<std::size_t>(k) * step] = static_cast<float>(sum) * share;
      }
    }
}

// Three boxes each way: of about that standard deviation.
image_float blurred(image_float image, double sigma) {
  int const r = static_cast<int>(std::lround(0.5 * (std::sqrt(4 * sigma * sigma + 1) - 1)));
  for (int pass = 0; r > 0 && pass < 3; ++pass) box(image, r, true), box(image, r, false);
  return image;
}

double mean_square(image_float const& image) {
  double sum = 0;
  for (float const x : image.data) sum += double{x} * double{x};
  return sum / static_cast<double>(image.data.size());
}

// A ray of a grid over the image, in the camera's axes. `right` and `down` are the sphere's directions that are dual to
// a pixel to the right and one down.
struct grid_ray {
  int x, y;
  vec3d direction, right, down;
};

std::vector<grid_ray> grid_of(camera const& view, int stride) {
  mat3d const back = glm::transpose(axes_of(view));
  auto const ray = [&](double x, double y) {
    return back * vec3d(ray_direction(view, static_cast<float>(x), static_cast<float>(y)));
  };
  std::vector<grid_ray> out;
  for (int y = stride / 2 + 1; y + 1 < view.height; y += stride)
    for (int x = stride / 2 + 1; x + 1 < view.width; x += stride) {
      double const u = x + 0.5, v = y + 0.5;
      vec3d const by_u = 0.5 * (ray(u + 1, v) - ray(u - 1, v)), by_v = 0.5 * (ray(u, v + 1) - ray(u, v - 1));
      double const uu = glm::dot(by_u, by_u), uv = glm::dot(by_u, by_v), vv = glm::dot(by_v, by_v);
      double const det = uu * vv - uv * uv;
      if (!(det > 0)) continue;
      out.push_back({x, y, ray(u, v), (by_u * vv - by_v * uv) / det, (by_v * uu - by_u * uv) / det});
    }
  return out;
}

// The curvature of the mean of squares by (t, w), without second derivatives of the image.
mat6 curvature(std::vector<grid_ray> const& grid, int stride, image_float const& image, rendered const& r) {
  mat6 out{};
  auto const at = [&](int x, int y, int c) {
    return double{image.data[(static_cast<std::size_t>(y) * image.width + static_cast<std::size_t>(x)) * 3 +
                             static_cast<std::size_t>(c)]};
  };
  for (grid_ray const& ray : grid) {
    std::size_t const pixel = static_cast<std::size_t>(ray.y) * image.width + static_cast<std::size_t>(ray.x);
    double const depth = double{r.depth.data[pixel]}, covered = 1 - double{r.transmittance.data[pixel]};
    double const nearness = depth > 1e-12 ? covered / depth : 0;
    // Slopes to either side: what changes from pixel to pixel cancels in a difference over two.
    for (int k = 0; k < 6; ++k) {
      int const c = k / 2, side = k % 2 ? 1 : -1;
      double const by_x = side * (at(ray.x + side, ray.y, c) - at(ray.x, ray.y, c));
      double const by_y = side * (at(ray.x, ray.y + side, c) - at(ray.x, ray.y, c));
      vec3d const n = ray.right * by_x + ray.down * by_y, t = n * nearness, w = glm::cross(ray.direction, n);
      vec6 const slope{t.x, t.y, t.z, w.x, w.y, w.z};
      for (std::size_t i = 0; i < numbers; ++i)
        for (std::size_t j = 0; j < numbers; ++j) out[i][j] += slope[i] * slope[j];
    }
  }
  double const scale = 1.0 * stride * stride / static_cast<double>(image.data.size());
  for (vec6& row : out)
    for (double& x : row) x *= scale;
  return out;
}

// -H^-1 g
vec6 step_of(mat6 h, vec6 const& g) {
  vec6 out;
  double largest = 0;
  for (std::size_t i = 0; i < numbers; ++i) largest = std::max(largest, h[i][i]);
  for (std::size_t i = 0; i < numbers; ++i) h[i][i] += 1e-9 * largest + 1e-300, out[i] = -g[i];
  for (std::size_t p = 0; p < numbers; ++p)
    for (std::size_t i = p + 1; i < numbers; ++i) {
      double const factor = h[i][p] / h[p][p];
      for (std::size_t j = p; j < numbers; ++j) h[i][j] -= factor * h[p][j];
      out[i] -= factor * out[p];
    }
  for (std::size_t p = numbers; p-- > 0;) {
    for (std::size_t j = p + 1; j < numbers; ++j) out[p] -= h[p][j] * out[j];
    out[p] /= h[p][p];
  }
  return out;
}

double dot(vec6 const& a, vec6 const& b) {
  double sum = 0;
  for (std::size_t i = 0; i < numbers; ++i) sum += a[i] * b[i];
  return sum;
}

// The curvature that the gradient's change over a step asks for (Broyden, Fletcher, Goldfarb, Shanno).
void learn(mat6& h, vec6 const& step, vec6 const& change) {
  vec6 along{};
  for (std::size_t i = 0; i < numbers; ++i) along[i] = dot(h[i], step);
  double const seen = dot(step, change), expected = dot(step, along);
  if (!(seen > 1e-4 * expected && expected > 0)) return;
  for (std::size_t i = 0; i < numbers; ++i)
    for (std::size_t j = 0; j < numbers; ++j) h[i][j] += change[i] * change[j] / seen - along[i] * along[j] / expected;
}

class tracker {
 public:
  tracker(renderer& by, image_float const& photo, camera const& guess, track_options const& options, image8 const& mask)
      : renderer_(by),
        photo_(photo),
        mask_(mask),
        options_(options),
        best_(guess),
        sigma_(options.blur * static_cast<float>(guess.width)) {
    while (stride_ * stride_ * 30000LL < 1LL * guess.width * guess.height) ++stride_;
    grid_ = grid_of(guess, stride_);
  }

  track_result run() {
    track_result out{best_, {}};
    camera candidate = best_;
    vec6 by{};
    for (int step = 0; step < options_.steps; ++step) {
      rendered image = renderer_.render(candidate, options_.render);
      apply(options_.response, image.color);
      double const loss = loss_of(image.color), slope = dot(gradient_, by);
      if (loss < loss_) {
        bool const slow = loss > 0.9 * loss_;
        best_ = candidate, image_ = std::move(image), loss_ = loss;
        if (step == 0 || (slow && finer())) {
          begin();
        } else {
          vec6 const before = std::exchange(gradient_, gradient());
          vec6 change = gradient_;
          for (std::size_t k = 0; k < numbers; ++k) change[k] -= before[k];
          learn(curvature_, by, change);
          rejected_ = 0;
        }
        by = step_of(curvature_, gradient_);
      } else if (++rejected_ > 8 || !(slope < 0)) {
        if (!finer()) break;
        begin();
        by = step_of(curvature_, gradient_);
      } else {
        // Goes to the minimum of the parabola through both losses and the slope.
        double const share = std::clamp(-0.5 * slope / (loss - loss_ - slope), 0.05, 0.5);
        for (double& x : by) x *= share;
      }
      out.residuals.push_back(static_cast<float>(std::sqrt(mean_square(difference(image_.color)))));
      double length = 0;
      for (double const x : by) length = std::max(length, std::abs(x));
      if (sigma_ == 0 && length < 1e-8) break;
      candidate = moved(best_, by, 1);
    }
    out.view = best_;
    return out;
  }

 private:
  image_float difference(image_float image) const {
    std::size_t const pixels = image.data.size() / 3;
    for (std::size_t p = 0; p < pixels; ++p) {
      bool const counts = mask_.empty() || mask_.data[p] != 0;
      for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) image.data[c] = counts ? image.data[c] - photo_.data[c] : 0;
    }
    return image;
  }
  double loss_of(image_float const& image) const { return mean_square(blurred(difference(image), sigma_)); }

  // The next blur, at which the best image has another loss; false at the end.
  bool finer() {
    if (sigma_ == 0) return false;
    sigma_ = sigma_ > 1.5 ? sigma_ / 2 : 0;
    loss_ = loss_of(image_.color);
    return true;
  }

  // At a blur: the gradient, and the curvature that the images tell.
  void begin() {
    rejected_ = 0, gradient_ = gradient();
    curvature_ = curvature(grid_, stride_, blurred(image_.color, sigma_), image_);
  }

  vec6 gradient() {
    image_float by_image = blurred(blurred(difference(image_.color), sigma_), sigma_);
    float const scale = 2.0f / static_cast<float>(by_image.data.size());
    float const* const m = options_.response.exposed.m;
    for (std::size_t p = 0; p + 3 <= by_image.data.size(); p += 3) {
      float* const g = by_image.data.data() + p;
      bool const counts = mask_.empty() || mask_.data[p / 3] != 0;
      int const pixel = static_cast<int>(p / 3);
      float const d[3] = {g[0] * scale, g[1] * scale, g[2] * scale};
      for (int c = 0; c < 3; ++c) {
        float const gain = options_.response.gain(c, pixel % by_image.width, pixel / by_image.width);
        g[c] = counts ? gain * (m[c] * d[0] + m[4 + c] * d[1] + m[8 + c] * d[2]) : 0;
      }
    }
    renderer_.differentiate(best_, options_.render, by_image);
    return pull_back(best_, {}, 1, renderer_.differentiate_pose());
  }

  renderer& renderer_;
  image_float const& photo_;
  image8 const& mask_;
  track_options const& options_;
  camera best_;
  rendered image_;
  double sigma_, loss_ = HUGE_VAL;
  int stride_ = 1, rejected_ = 0;
  std::vector<grid_ray> grid_;
  vec6 gradient_{};
  mat6 curvature_{};
};

}  // namespace

track_result track(renderer& renderer, image_float const& photo, camera const& guess, track_options const& options,
                   image8 const& mask) {
  require_camera(guess);
  if (photo.width != guess.width || photo.height != guess.height || photo.channels != 3)
    throw invalid_argument("track: the photograph must have three channels and the camera's width and height");
  if (!mask.empty() && (mask.width != photo.width || mask.height != photo.height || mask.channels != 1))
    throw invalid_argument("track: the mask must have one channel and the photograph's width and height");
  if (options.steps < 1 || !(options.blur >= 0 && options.blur <= 0.5f))
    throw invalid_argument("track: track_options.steps must be positive, and blur a share of the width from 0 to 0.5");
  return tracker(renderer, photo, guess, options, mask).run();
}

}  // namespace gart
