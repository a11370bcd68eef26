// Messages that a viewer's client sends, through the parser and, where they are taken, through the path that they ask
// for.

#include "fuzz/support.hpp"

#include <gart/view/camera_path.hpp>
#include <gart/view/message.hpp>

namespace gart_fuzz {

namespace {

void check_settings(gart::view_settings const& s) {
  promise(!s.near || *s.near > 0, "a near distance that is none");
  promise(s.opacity > 0 && s.size > 0, "a factor that is none");
  if (!s.crop) return;
  for (int k = 0; k < 3; ++k) promise(s.crop->low[k] <= s.crop->high[k], "a crop box that is none");
}

struct check {
  void operator()(gart::view_message const& m) const {
    check_camera(m.view);
    check_settings(m.settings);
    promise(m.view.width <= gart::view_size_most && m.view.height <= gart::view_size_most, "a view that is too large");
    promise(!m.photo || *m.photo >= 0, "a photograph of no camera");
  }
  void operator()(gart::image_message const& m) const {
    check_camera(m.view);
    check_settings(m.settings);
    promise(static_cast<double>(m.view.width) * m.view.height <= gart::image_pixels_most, "an image that is too large");
  }
  void operator()(gart::model_message const& m) const { promise(m.index >= 0, "a model of no number"); }
  void operator()(gart::pick_message const& m) const {
    check_camera(m.view);
    check_settings(m.settings);
    promise(m.x >= 0 && m.y >= 0 && finite({m.x, m.y}), "a point outside of its view");
  }
  void operator()(gart::path_message const& m) const {
    promise(m.keyframes.size() >= 2 && m.frames >= 2 && m.frames <= gart::path_frames_most, "a path that is none");
    try {
      for (gart::camera const& c : gart::smooth_path(m.keyframes, std::min(m.frames, 20), m.closed, m.times))
        check_camera(c);
    } catch (gart::invalid_argument const&) {  // cameras of different models, times that do not rise
    }
  }
  void operator()(gart::train_message const& m) const {
    promise(to_string(m.action)[0] != '?', "an action of no name");
  }
  void operator()(gart::share_message const& m) const {
    promise(m.value >= 0.01 && m.value <= 1, "a share out of its range");
  }
  void operator()(gart::part_message const& m) const {
    promise(m.edit.index >= 0, "a part of no number");
    if (auto const& place = m.edit.place) promise(finite(gart::vec3d(*place)), "a place that is none");
    if (auto const& about = m.edit.about) promise(finite(gart::vec3d(*about)), "a point that is none");
    if (auto const& scale = m.edit.scale)
      promise(finite(*scale) && scale->x != 0 && scale->y != 0 && scale->z != 0, "a scale that is none");
    if (auto const& q = m.edit.rotation) {
      double sum = 0;
      for (double const x : *q) sum += x * x;
      promise(sum > 0 && std::isfinite(sum), "a rotation that is none");
    }
    if (auto const& color = m.edit.color)
      for (int k = 0; k < 3; ++k) promise((*color)[k] >= 0 && (*color)[k] <= 1e12f, "a colour that is none");
  }
};

}  // namespace

bool view_message(std::string_view input) {
  gart::client_message message;
  try {
    message = gart::parse_message(input);
  } catch (gart::invalid_argument const&) {
    return false;
  }
  std::visit(check{}, message);
  return true;
}

}  // namespace gart_fuzz
