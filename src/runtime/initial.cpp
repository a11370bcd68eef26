#include <gart/camera/models.hpp>
#include <gart/core/error.hpp>
#include <gart/math/sh.hpp>
#include <gart/optim/random.hpp>
#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/initial.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace gart {

namespace {

// A k-d tree in place: `order` split at its median along the widest axis, recursively.
class nearest_three {
 public:
  explicit nearest_three(std::vector<float> const& position) : p_(position), order_(position.size() / 3) {
    std::iota(order_.begin(), order_.end(), u32{0});
    axis_.resize(order_.size());
    split(0, order_.size());
  }
  // Squared distances to the nearest three others, fewer where there are fewer.
  float mean_distance2(u32 point) const {
    best found;
    search(0, order_.size(), point, found);
    double sum = 0;
    int count = 0;
    for (float d : found.d2)
      if (d < unbounded) sum += d, ++count;
    return count ? static_cast<float>(sum / count) : 0.0f;
  }

 private:
  static constexpr float unbounded = 3e38f;
  struct best {
    std::array<float, 3> d2{unbounded, unbounded, unbounded};
    void offer(float d) {
      for (float& slot : d2)
        if (d < slot) std::swap(d, slot);
    }
  };

  float at(u32 point, int axis) const { return p_[std::size_t{3} * point + axis]; }

  void split(std::size_t first, std::size_t last) {
    if (last - first <= 1) return;
    int widest = 0;
    float width = -1;
    for (int a = 0; a < 3; ++a) {
      float lo = unbounded, hi = -unbounded;
      for (std::size_t i = first; i < last; ++i)
        lo = std::min(lo, at(order_[i], a)), hi = std::max(hi, at(order_[i], a));
      if (hi - lo > width) width = hi - lo, widest = a;
    }
    std::size_t const middle = first + (last - first) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                     [&](u32 a, u32 b) { return at(a, widest) < at(b, widest); });
    axis_[middle] = static_cast<u8>(widest);
    split(first, middle);
    split(middle + 1, last);
  }

  void search(std::size_t first, std::size_t last, u32 point, best& found) const {
    if (first >= last) return;
    std::size_t const middle = first + (last - first) / 2;
    u32 const other = order_[middle];
    if (other != point) {
      float d2 = 0;
      for (int a = 0; a < 3; ++a) d2 += (at(point, a) - at(other, a)) * (at(point, a) - at(other, a));
      found.offer(d2);
    }
    float const side = at(point, axis_[middle]) - at(other, axis_[middle]);
    bool const left = side < 0;
    search(left ? first : middle + 1, left ? middle : last, point, found);
    if (side * side < found.d2[2]) search(left ? middle + 1 : first, left ? last : middle, point, found);
  }

  std::vector<float> const& p_;
  std::vector<u32> order_;
  std::vector<u8> axis_;
};

}  // namespace

std::vector<float> neighbor_distance2(std::vector<float> const& position) {
  nearest_three const tree(position);
  std::vector<float> out(position.size() / 3);
#if defined(_OPENMP)
#pragma omp parallel for schedule(dynamic, 1024)
#endif
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = tree.mean_distance2(static_cast<u32>(i));
  return out;
}

gaussian_model model_from_points(point_cloud const& points, int sh_degree, float o, float scale, float least_distance) {
  if (!(o > 0 && o < 1)) throw invalid_argument("train_options.initial_opacity must lie between 0 and 1");
  if (!(scale > 0)) throw invalid_argument("train_options.initial_scale must be positive");
  gaussian_model m;
  m.resize(points.size(), sh_degree);
  std::vector<float> const d2 = neighbor_distance2(points.position);
  m.mean = points.position;
  std::size_t const stride = m.size() ? m.sh.size() / m.size() : 0;
  for (std::size_t i = 0; i < m.size(); ++i) {
    float const s = std::log(std::sqrt(std::max(d2[i], least_distance * least_distance)) * scale);
    for (int a = 0; a < 3; ++a) m.log_scale[3 * i + a] = s;
    m.quaternion[4 * i] = 1;
    m.opacity[i] = std::log(o / (1 - o));
    // Black is a little more than none: a channel at the clamp has no gradient and would stay there.
    for (int c = 0; c < 3; ++c)
      m.sh[stride * i + c] = (std::max(static_cast<float>(points.color[3 * i + c]), 0.5f) / 255.0f - 0.5f) /
                             static_cast<float>(sh_constant);
  }
  return m;
}

point_cloud random_points(vec3d lo, vec3d hi, index_t count, u64 seed) {
  random_source const source{seed, 0, random_use::user};
  point_cloud out;
  for (index_t i = 0; i < count; ++i) {
    auto const a = source.words(2 * u64{i}), b = source.words(2 * u64{i} + 1);
    for (int k = 0; k < 3; ++k) {
      out.position.push_back(static_cast<float>(lo[k] + (hi[k] - lo[k]) * uniform(a.v[k])));
      out.color.push_back(static_cast<u8>(uniform(b.v[k]) * 255.0f));
    }
  }
  return out;
}

point_cloud points_of_maps(dataset const& data, index_t count, u64 seed, std::vector<std::size_t> const& but) {
  std::vector<dataset_view const*> views;
  std::vector<u64> until;  // pixels up to and with each
  u64 pixels = 0;
  for (std::size_t i = 0; i < data.train.size(); ++i) {
    dataset_view const& v = data.train[i];
    if (v.depth.empty() || v.image.empty() || std::find(but.begin(), but.end(), i) != but.end()) continue;
    pixels += v.depth.data.size();
    views.push_back(&v), until.push_back(pixels);
  }
  random_source const source{seed, 2, random_use::user};
  point_cloud out;
  // Where most pixels have no distance, the tries end before the points are complete.
  u64 const tries = pixels ? 20 * u64{count} : 0;
  for (u64 k = 0; k < tries && out.size() < count; ++k) {
    auto const w = source.words(k);
    u64 const at = below(w.v[0], w.v[1], pixels);
    auto const found = static_cast<std::size_t>(std::upper_bound(until.begin(), until.end(), at) - until.begin());
    dataset_view const& v = *views[found];
    std::size_t const pixel = static_cast<std::size_t>(at - (found ? until[found - 1] : 0));
    int const x = static_cast<int>(pixel) % v.view.width, y = static_cast<int>(pixel) / v.view.width;
    float const distance = v.depth.data[pixel];
    bool const clear = v.image.channels == 4 && v.image.at(x, y, 3) < 128;
    if (!(distance > 0) || clear || (!v.mask.empty() && v.mask.data[pixel] == 0)) continue;
    ray const r = ray_through(v.view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    for (int c = 0; c < 3; ++c) {
      out.position.push_back(
          static_cast<float>(v.view.position[c] + double{r.origin[c]} + double{distance} * r.direction[c]));
      out.color.push_back(v.image.at(x, y, v.image.channels >= 3 ? c : 0));
    }
  }
  return out;
}

gaussian_model initial_model(dataset const& data, train_options const& options, int sh_degree) {
  if (options.max_gaussians == 0) throw invalid_argument("train_options.max_gaussians must be at least 1");
  starting_points const start = choose_start(data, options).value;
  point_cloud points = start.measured ? points_of_maps(data, start.count, options.seed, options.held_out)
                       : start.random ? random_points(data.bounds_min, data.bounds_max, start.count, options.seed)
                                      : data.points;
  if (start.matched) {
    points.position.insert(points.position.end(), data.matched.position.begin(), data.matched.position.end());
    points.color.insert(points.color.end(), data.matched.color.begin(), data.matched.color.end());
  }
  if (start.measured && points.size() == 0)
    throw invalid_argument(
        "train_options.depth_weight: no depth map has a distance where its photograph is opaque and not masked "
        "(correct the maps, or train without them)");
  if (points.size() > options.max_gaussians) {
    // A random subset: the first n of a shuffle.
    random_source const source{options.seed, 1, random_use::user};
    for (std::size_t i = 0; i < options.max_gaussians; ++i) {
      auto const w = source.words(i);
      std::size_t const j = i + below(w.v[0], w.v[1], points.size() - i);
      for (int k = 0; k < 3; ++k) {
        std::swap(points.position[3 * i + k], points.position[3 * j + k]);
        std::swap(points.color[3 * i + k], points.color[3 * j + k]);
      }
    }
    points.position.resize(std::size_t{3} * options.max_gaussians);
    points.color.resize(std::size_t{3} * options.max_gaussians);
  }
  return model_from_points(points, sh_degree, start.opacity, start.scale, 1e-4f * data.extent);
}

}  // namespace gart
