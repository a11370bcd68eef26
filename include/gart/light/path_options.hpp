#pragma once
/// \file
/// How paths of light are traced through Gaussians and surfaces, and how their sums become pictures.
/// Errors: require_path_options throws invalid_argument, naming the option.

#include <gart/core/names.hpp>
#include <gart/core/types.hpp>

namespace gart::light {

/// Shadows of meshes on Gaussians.
enum class shadow_kind {
  none,          ///< Gaussians are as they were captured
  per_gaussian,  ///< one visibility a Gaussian and light, of its centre: once for all pixels
  per_hit,       ///< of each hit, where its ray meets it: sharp edges within a Gaussian, and many more shadow rays
};
/// Their names.
constexpr auto names_of(shadow_kind) {
  using enum shadow_kind;
  return std::array<name_of<shadow_kind>, 3>{{{none, "none"}, {per_gaussian, "per-gaussian"}, {per_hit, "per-hit"}}};
}

/// From linear radiance to what a screen shows.
enum class tone_kind {
  none,    ///< as it is
  srgb,    ///< clamped, in sRGB's curve
  filmic,  ///< highlights roll off, then sRGB's curve
};
/// Their names.
constexpr auto names_of(tone_kind) {
  using enum tone_kind;
  return std::array<name_of<tone_kind>, 3>{{{none, "none"}, {srgb, "srgb"}, {filmic, "filmic"}}};
}

/// What a picture is traced by, besides render_options.
struct path_options {
  int samples = 16;        ///< paths a pixel, 1 or more
  int bounces = 4;         ///< surfaces that a path goes on from, at most; 0: Gaussians and what shines alone
  int roulette_after = 3;  ///< bounces after which weak paths end at random
  u64 seed = 0;            ///< of all that is random
  shadow_kind shadows = shadow_kind::per_gaussian;  ///< of meshes on Gaussians
  float ambient = 0.3f;  ///< light that no shadow takes, in parts of all that the lights give; [0, 1]
  bool relight = false;  ///< the lights' colours on the Gaussians' albedo, in place of what was captured
  bool linear = false;   ///< the Gaussians' colours are in sRGB's curve: each hit is decoded before it is blended
  float aperture = 0;    ///< radius of the lens, world units; 0: all is sharp
  float focus = 1;       ///< distance along the axis that is sharp, world units
  float blur = 0;        ///< exposure, in parts of the camera's travel and turn; 0: one moment
  bool jitter = true;    ///< rays go through all of a pixel, else through its middle
  float firefly = 0;     ///< most radiance that one path adds after its first bounce; 0: no bound
  float exposure = 0;    ///< stops
  tone_kind tone = tone_kind::none;  ///< of path_renderer::picture
};

/// Throws invalid_argument, with the option and its value, where one is out of its range.
void require_path_options(path_options const& o);

}  // namespace gart::light
