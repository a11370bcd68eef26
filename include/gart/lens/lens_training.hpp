#pragma once
/// \file
/// Lenses of a capture, learned with the Gaussians. Adam moves three numbers of each camera (lens/lens_numbers.hpp) on
/// the host (optim/host_adam.hpp). Views of the same model, size and lens share a camera.
///
/// A gradient that is not finite moves nothing. Each number stays within half the focal length either way, so the focal
/// length stays positive. Cost: none that shows beside the gradient's.

#include <gart/lens/differentiate_lens.hpp>
#include <gart/lens/lens_numbers.hpp>
#include <gart/lens/options.hpp>
#include <gart/optim/host_adam.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gart { inline namespace GART_ISA {

/// The lenses of a run.
class lens_training : public host_adam<lens_options, 3> {
 public:
  /// For the capture's cameras of these views. Errors: invalid_argument, naming the view, for a camera without a focal
  /// length.
  lens_training(lens_options const& options, std::vector<named_camera> const& views)
      : lens_training(options, views, cameras_of(views)) {}

  /// A camera of the capture, at any pose, with its learned lens; other cameras stay unchanged.
  camera view(camera const& captured) const {
    std::size_t const k = place_of(captured, captured_);
    return k < captured_.size() && visits_[k] ? through(captured, numbers(k)) : captured;
  }

  /// Moves the lens of view i by the gradient at its present value.
  void step(std::size_t i, lens_gradient const& by, int step, int iterations) {
    std::size_t const k = of_view_[i];
    camera const& c = captured_[k];
    double const fx = c.fx, fy = c.fy;
    lens_numbers const slope = {by.fx * fx + by.fy * fy, by.cx * fx, by.cy * fy};
    for (double const x : slope)
      if (!std::isfinite(x)) return;
    lens_numbers const moves = move(k, slope, step, iterations);
    for (std::size_t j = 0; j < moves.size(); ++j) {
      double& x = value_[3 * k + j];
      x = std::clamp(x - moves[j], -0.5, 0.5);  // a focal length stays positive
    }
  }

  /// For a checkpoint.
  void save(named_arrays& to) const { host_adam::save(to, "lens"); }
  /// From a checkpoint of as many.
  void load(named_arrays const& from) {
    lens_training taken = *this;
    taken.host_adam::load(from, "lens");
    *this = std::move(taken);
  }

 private:
  lens_training(lens_options const& options, std::vector<named_camera> const& views, std::vector<camera> captured)
      : host_adam(options, captured.size()), captured_(std::move(captured)) {
    for (named_camera const& v : views) of_view_.push_back(place_of(v.view, captured_));
  }
  static std::vector<camera> cameras_of(std::vector<named_camera> const& views) {
    std::vector<camera> all;
    for (named_camera const& v : views) {
      visit_camera(v.view, [&]<class M>(M const&) {
        if constexpr (!focal_camera<M>)
          throw invalid_argument("train_options.refine_lens: view " + v.name +
                                 " has no focal length and no principal point to learn (equirectangular)");
      });
      if (place_of(v.view, all) == all.size()) all.push_back(v.view);
    }
    return all;
  }
  static std::size_t place_of(camera const& view, std::vector<camera> const& among) {
    auto const at = std::find_if(among.begin(), among.end(), [&](camera const& c) { return same_lens(c, view); });
    return static_cast<std::size_t>(at - among.begin());
  }

  std::vector<camera> captured_;      // one view of each
  std::vector<std::size_t> of_view_;  // index in captured_ for each training view
};

}}  // namespace gart::GART_ISA
