#pragma once
/// \file
/// Scores of rendered views against photographs: PSNR and SSIM (gart/loss/metrics.hpp), means over views. A diagnostic
/// is PSNR after each view's best affine colour (gart/loss/affine_color.hpp).
/// Errors: gart::error, naming the view, where the render has another size than the photograph.

#include <gart/exposure/exposure_field.hpp>
#include <gart/io/dataset.hpp>
#include <gart/render/rendered.hpp>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace gart {

/// One view against its photograph.
struct view_score {
  std::string name;          ///< the view's
  double psnr = 0,           ///< in dB
      ssim = 0;              ///< at most 1
  double affine_psnr = 0;    ///< after the affine colour that fits best
  double own_psnr = 0;       ///< of the scene's own colours, without exposure and lens
  double captured_psnr = 0;  ///< at the capture's pose, where the view was placed at another
  double milliseconds = 0;   ///< of rendering, to an image in host memory
};

/// Means over views.
struct scores {
  double psnr = std::numeric_limits<double>::quiet_NaN();           ///< stays so where there are no views
  double ssim = std::numeric_limits<double>::quiet_NaN();           ///< from 0 to 1
  double affine_psnr = std::numeric_limits<double>::quiet_NaN();    ///< in dB
  double own_psnr = std::numeric_limits<double>::quiet_NaN();       ///< in dB
  double captured_psnr = std::numeric_limits<double>::quiet_NaN();  ///< in dB
  bool placed = false;            ///< whether views were scored at other poses than the capture's
  bool exposed = false;           ///< whether views were scored with exposures or through lenses
  std::vector<view_score> views;  ///< each of them, in order
};

using some_views = std::vector<dataset_view const*>;  ///< of a dataset, which must outlive it
/// All views, in order.
some_views all_of(std::vector<dataset_view> const& views);
/// At most `count` of them, from the middles of as many equal parts: the same in every run.
some_views evenly_spread(std::vector<dataset_view> const& views, std::size_t count);

using render_view = std::function<rendered(camera const&)>;  ///< one view to host memory
/// A view's camera where it is not the capture's: learned, or aligned to its photograph.
using place_view = std::function<camera(dataset_view const&)>;
/// Sees each scored view, in order.
using keep_view =
    std::function<void(std::size_t index, view_score const&, image_float const& render, image_float const& truth)>;

/// Where views are placed, each is also scored at the capture's pose. Where there are exposures each view is scored
/// with its own, as the field gives it for the camera.
scores evaluate(some_views const& views, vec3 background, exposure_field const& exposures, render_view const& render,
                keep_view const& keep = {}, place_view const& place = {});
/// Sets the means from the views': of scores that were put together from several.
void take_means(scores& of);

}  // namespace gart
