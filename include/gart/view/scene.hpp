#pragma once
/// \file
/// The description of a scene and of a training for viewers, and the settings of a view.

#include <gart/core/names.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/scene/image_rows.hpp>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gart {

/// What of a view is shown.
enum class view_mode {
  colour,    ///< as a photograph would be
  depth,     ///< the mean distance along the ray, in colours
  normal,    ///< of the surface that the distances make, in the world's axes, (n + 1) / 2
  alpha,     ///< how much of the ray is stopped, in grey
  hits,      ///< Gaussians met, in colours
  error,     ///< the absolute difference to a photograph, mean over the colours, in colours
  features,  ///< one or three features of the Gaussians, in colours (view/shown_features.hpp)
};
/// Their names.
constexpr auto names_of(view_mode) {
  return std::array<name_of<view_mode>, 7>{{{view_mode::colour, "colour"},
                                            {view_mode::depth, "depth"},
                                            {view_mode::normal, "normal"},
                                            {view_mode::alpha, "alpha"},
                                            {view_mode::hits, "hits"},
                                            {view_mode::error, "error"},
                                            {view_mode::features, "features"}}};
}

/// A box along the axes of the world.
struct view_box {
  vec3 low{0.0f}, high{0.0f};  ///< corners
  /// Whether they are the same.
  friend bool operator==(view_box const&, view_box const&) = default;
};

/// What Gaussians are drawn as.
enum class view_shape {
  gaussians,   ///< as they are
  ellipsoids,  ///< opaque to one standard deviation, and nothing beyond
  points,      ///< opaque balls of one size at their means
};
/// Their names.
constexpr auto names_of(view_shape) {
  return std::array<name_of<view_shape>, 3>{
      {{view_shape::gaussians, "gaussians"}, {view_shape::ellipsoids, "ellipsoids"}, {view_shape::points, "points"}}};
}

/// What is wanted of views that are means of random samples.
enum class view_effort {
  draft,  ///< little: it moves, and another follows soon
  begun,  ///< the first samples of a view at rest
  more,   ///< more samples of the view that was rendered last
};

/// How a view differs from what the model is. All but `background`, `rows` and `effort` change the Gaussians that are
/// traced.
struct view_settings {
  std::optional<view_box> crop;              ///< Gaussians whose mean lies outside are left out
  std::optional<float> near;                 ///< hits nearer than that along the ray are left out
  std::optional<vec3> background;            ///< in place of the model's own
  float opacity = 1;                         ///< times that of every Gaussian; 0.001 to 1000
  float size = 1;                            ///< times every standard deviation; 0.001 to 1000
  view_shape shape = view_shape::gaussians;  ///< what is drawn
  /// Features that are traced too: the places of one or three, or none for the first three principal directions.
  std::optional<std::vector<int>> features = {};
  view_effort effort = view_effort::begun;  ///< where that is heeded
  image_rows rows = {};                     ///< the part that is traced, in whole tiles, where that is heeded

  /// Whether the Gaussians are traced as they are.
  bool own_gaussians() const { return !crop && opacity == 1 && size == 1 && shape == view_shape::gaussians; }
};

/// A camera of the capture.
struct view_camera {
  std::string name;    ///< the capture's camera
  camera view;         ///< its pose, lens and size
  bool test = false;   ///< held out of the training
  bool photo = false;  ///< whether it has a photograph
};

/// A mesh or a light of a scene that a viewer may change.
struct view_part {
  bool light = false;          ///< else it is a mesh
  std::string name;            ///< as people call it
  std::string kind;            ///< of a light: point, directional, sphere, rectangle. Of a mesh: its material, or "own"
  vec3 place{0.0f};            ///< the middle of a mesh; of a directional light a point that it comes from
  vec3 low{0.0f}, high{0.0f};  ///< of a mesh: its corners
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< of a mesh: w, x, y, z, as its file has it
  vec3d scale{1.0};                            ///< of a mesh, along its own axes
  vec3 color{0.0f};                            ///< of a light
};

/// What is changed of one of them.
struct part_edit {
  int index = 0;                             ///< which of view_scene.parts
  std::optional<vec3> place = {};            ///< where it is to stand
  std::optional<std::string> material = {};  ///< of a mesh: a name of light::material_kind, or "own", as its file says
  std::optional<vec3> color = {};            ///< of a light, in the units of light::light
  std::optional<std::array<double, 4>> rotation = {};  ///< of a mesh: in place of view_part's
  std::optional<vec3d> scale = {};                     ///< of a mesh: in place of view_part's, no number is zero
  std::optional<vec3> about = {};                      ///< the point that both leave where it is; else the place
};

/// What there is to see.
struct view_scene {
  std::string name;                   ///< of the model, as people call it
  std::size_t gaussians = 0;          ///< their number
  int sh_degree = 0;                  ///< of their colours
  int kernel_degree = 2;              ///< of their response
  int features = 0;                   ///< of each that can be shown
  std::vector<view_part> parts = {};  ///< of a scene of meshes and lights (view/edited_scene.hpp)
  std::string scene_json = {};        ///< its text, to be saved
  bool traced = false;                ///< whether views are paths of light, which count no hits
  view_box bounds;                    ///< from the 1st to the 99th hundredth of the means, along each axis
  vec3 up{0.0f, -1.0f, 0.0f};         ///< away from the ground
  vec3d origin{0.0};                  ///< of all coordinates (io/origin.hpp)
  std::vector<view_camera> cameras;   ///< of the capture
  std::vector<std::string> models;    ///< what else may be opened, and this one; for clients with the right of control
  int model = 0;                      ///< which of them this is
  bool training = false;              ///< whether it changes
  vec3 background{0.0f};              ///< behind the last hit
};

/// Half the diagonal of its bounds.
float extent_of(view_scene const& scene);

/// The scene of a model and of a capture's cameras. Up is the mean of the cameras' own, or -y where there are none.
view_scene scene_of(std::string name, gaussian_model const& model, int kernel_degree,
                    std::vector<view_camera> cameras = {});

/// The Gaussians whose mean lies in the box, faces included.
gaussian_model cropped(gaussian_model const& model, view_box const& box);

/// The Gaussians that are traced of a model for these settings. Ellipsoids and points are hit where their response is
/// at least `solid_response`, which is then the render's alpha_min. Those fainter than `faintest_solid` after the
/// factor are left out. `extent` is half the scene's diagonal: a point's radius is 0.004 of it.
gaussian_model altered(gaussian_model model, view_settings const& settings, int kernel_degree, float extent);
inline constexpr float solid_response = 0.8f;   ///< at the rim of an ellipsoid
inline constexpr float faintest_solid = 0.05f;  ///< opacity

/// A training, while it runs.
struct view_status {
  int step = 0, of = 0;         ///< done, and in all
  double loss = 0;              ///< of the last steps
  std::size_t gaussians = 0;    ///< their number
  double seconds = 0;           ///< of training
  bool paused = false;          ///< whether it waits to be told to go on
  double steps_per_second = 0;  ///< of the last steps
  double view_share = 0;        ///< the share of time that views may take
};

/// A training's course.
struct view_curve {
  std::vector<std::pair<int, double>> loss;  ///< step and loss
  std::vector<std::pair<int, double>> test;  ///< step and PSNR of the test views, dB
};

}  // namespace gart
