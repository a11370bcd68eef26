// What of the options cannot be traced by.
#include <gart/core/error.hpp>
#include <gart/light/path_options.hpp>

#include <cmath>
#include <string>

namespace gart::light {

void require_path_options(path_options const& o) {
  auto const require = [](bool good, char const* field, char const* range, auto value) {
    if (!good)
      throw invalid_argument(std::string("path_options.") + field + " must be " + range + ", not " +
                             std::to_string(value));
  };
  require(o.samples >= 1, "samples", "1 or more", o.samples);
  require(o.bounces >= 0 && o.bounces <= 64, "bounces", "0 to 64", o.bounces);
  require(o.roulette_after >= 0, "roulette_after", "0 or more", o.roulette_after);
  require(o.ambient >= 0 && o.ambient <= 1, "ambient", "0 to 1", o.ambient);
  require(o.aperture >= 0 && std::isfinite(o.aperture), "aperture", "0 or more", o.aperture);
  require(o.focus > 0 && std::isfinite(o.focus), "focus", "more than 0", o.focus);
  require(o.blur >= 0 && o.blur <= 1, "blur", "0 to 1", o.blur);
  require(o.firefly >= 0 && std::isfinite(o.firefly), "firefly", "0 or more", o.firefly);
  require(std::fabs(o.exposure) <= 60, "exposure", "-60 to 60 stops", o.exposure);
}

}  // namespace gart::light
