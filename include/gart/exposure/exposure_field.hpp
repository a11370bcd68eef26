#pragma once
/// \file
/// The exposure of any view, predicted from the learned exposures of the training views. A camera sets its exposure by
/// the scene before it, and sees about the same from about the same pose. Photographs kept for testing are not used.
///
/// A view's place is six numbers. Three are the camera's position, over the median distance of a training view to its
/// nearest. Three are its axis over 0.1. For each of the twelve numbers of the exposure
///   minimise over a, b:  sum_i w_i (m_i - a - b . d_i)^2 + 0.02 (sum_i w_i) |b|^2 r^2,   w_i = (|d_i|^2 + 1e-4)^-3,
/// where d_i leads to training view i and r^2 is the weighted mean of |d_i|^2. The view gets the constant a of this
/// line through the nearest views. With b = 0, a weighted mean, a view predicted from the others has a quarter more
/// error. Far from all views the constant tends to their mean. The falloff is that of the lens with the nearest focal
/// lengths and principal point, over its images' size. Cost: O(views) in double for each call. Without views the
/// exposure is the identity, without lenses there is no falloff.

#include <gart/exposure/photo_response.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/camera.hpp>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

namespace gart {

/// The exposure of a training view, and its place.
struct view_exposure {
  std::string name;         ///< of the view
  vec3d position{0.0};      ///< the camera's
  vec3 direction{0, 0, 1};  ///< its axis, a unit vector
  exposure value;           ///< relative to the scene's colours
};

/// The falloff of a lens of the capture, and the numbers that identify the lens.
struct lens_falloff {
  vec2 focal{0}, center{0};  ///< focal lengths and principal point, over the images' width and height
  vignetting value;          ///< its falloff

  lens_falloff() = default;
  /// The falloff of a view's lens.
  GART_HD GART_INLINE lens_falloff(camera const& view, vignetting const& falloff) : value(falloff) {
    vec2 const size(static_cast<float>(view.width), static_cast<float>(view.height));
    focal = vec2(view.fx, view.fy) / size, center = vec2(view.cx, view.cy) / size;
  }
};

/// The exposures of all training views, and the falloffs of their lenses.
class exposure_field {
 public:
  exposure_field() = default;
  /// From these views and lenses.
  explicit exposure_field(std::vector<view_exposure> views, std::vector<lens_falloff> lenses = {})
      : views_(std::move(views)), lenses_(std::move(lenses)) {
    std::vector<double> nearest;
    double farthest = 0;
    for (auto const& a : views_) {
      double least = HUGE_VAL;
      for (auto const& b : views_) {
        double const d = glm::distance(a.position, b.position);
        if (d > 0) least = std::min(least, d);
        farthest = std::max(farthest, d);
      }
      if (least < HUGE_VAL) nearest.push_back(least);
    }
    if (nearest.empty()) return;
    auto const middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
    std::nth_element(nearest.begin(), middle, nearest.end());
    spacing_ = std::max(*middle, 1e-12 * farthest);
  }

  /// Whether there is no view and no lens.
  bool empty() const { return views_.empty() && lenses_.empty(); }
  /// As they were given.
  std::vector<view_exposure> const& views() const { return views_; }
  /// As they were given.
  std::vector<lens_falloff> const& lenses() const { return lenses_; }

  /// The training view whose pose is nearest to that of another; of at least two.
  std::size_t nearest(std::size_t view) const {
    camera pose;
    pose.position = views_[view].position, pose.rotation[2] = views_[view].direction;
    std::size_t best = view;
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      double const square = distance2(row_of(views_[i], pose));
      if (i != view && square < least) least = square, best = i;
    }
    return best;
  }

  /// The response of a photograph with the view's camera.
  photo_response at(camera const& view) const {
    photo_response out{exposure_at(view), {}, {}};
    if (view.kind == camera_kind::equirectangular) return out;  // no lens sees it
    lens_falloff const seen(view, {});
    float least = HUGE_VALF;
    for (lens_falloff const& l : lenses_) {
      vec2 const focal = l.focal - seen.focal, center = l.center - seen.center;
      float const far = glm::dot(focal, focal) + glm::dot(center, center);
      if (far < least) least = far, out.falloff = l.value, out.circle = image_circle(view);
    }
    return out;
  }

 private:
  exposure exposure_at(camera const& view) const {
    exposure out;
    if (views_.empty()) return out;
    // The normal equations, the constant first; weights relative to the largest, so that none underflows alone.
    std::vector<std::array<double, size>> rows;
    std::vector<double> weights;
    double spread = 0, nearest = HUGE_VAL;
    for (auto const& v : views_) {
      rows.push_back(row_of(v, view));
      weights.push_back(distance2(rows.back()) + 1e-4);
      nearest = std::min(nearest, weights.back());
    }
    for (double& w : weights) {
      double const square = w, ratio = nearest / square;
      w = ratio * ratio * ratio;
      spread += w * square;
    }
    matrix a{};
    std::array<std::array<double, exposure::floats>, size> right{};
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (int r = 0; r < size; ++r) {
        double const w = weights[i] * rows[i][r];
        for (int c = 0; c < size; ++c) a[r][c] += w * rows[i][c];
        for (int k = 0; k < exposure::floats; ++k) right[r][k] += w * static_cast<double>(views_[i].value.m[k]);
      }
    }
    for (int k = 1; k < size; ++k) a[k][k] += 0.02 * spread;
    eliminate(a, right);
    for (int k = 0; k < exposure::floats; ++k) out.m[k] = static_cast<float>(right[0][k] / a[0][0]);
    return out;
  }

  static constexpr int size = 7;
  using matrix = std::array<std::array<double, size>, size>;

  std::array<double, size> row_of(view_exposure const& v, camera const& view) const {
    vec3d const moved = (v.position - view.position) / spacing_;
    vec3d const turned = (vec3d(v.direction) - vec3d(view.rotation[2])) / 0.1;
    return {1, moved.x, moved.y, moved.z, turned.x, turned.y, turned.z};
  }

  static double distance2(std::array<double, size> const& row) {
    double square = 0;
    for (int k = 1; k < size; ++k) square += row[k] * row[k];
    return square;
  }

  // Eliminates upwards, so that the first row keeps the constant alone. The matrix is positive definite.
  template <class Right>
  static void eliminate(matrix& a, Right& right) {
    for (int p = size - 1; p > 0; --p) {
      for (int r = 0; r < p; ++r) {
        double const factor = a[r][p] / a[p][p];
        for (int c = 0; c <= p; ++c) a[r][c] -= factor * a[p][c];
        for (int k = 0; k < exposure::floats; ++k) right[r][k] -= factor * right[p][k];
      }
    }
  }

  std::vector<view_exposure> views_;
  std::vector<lens_falloff> lenses_;
  double spacing_ = 1;
};

}  // namespace gart
