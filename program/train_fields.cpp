#include "train_fields.hpp"

#include "commands.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <sstream>
#include <type_traits>
#include <vector>

namespace gart_cli {

namespace {

using options = gart::train_options;

struct field {
  char const* name;
  std::function<void(options&, double)> set;
};

// `of` gives the member of some options.
template <class F>
field named(char const* name, F of) {
  return {name, [of](options& o, double value) {
            auto& member = of(o);
            member = static_cast<std::remove_reference_t<decltype(member)>>(value);
          }};
}

std::vector<field> const& fields() {
  static std::vector<field> const all{
      named("near", [](options& o) -> float& { return o.near; }),
      named("ssim_weight", [](options& o) -> float& { return o.ssim_weight; }),
      named("antialias", [](options& o) -> float& { return o.render.antialias; }),
      named("dropout", [](options& o) -> float& { return o.dropout; }),
      named("dropout_until", [](options& o) -> float& { return o.dropout_until; }),
      named("resolution.quarter_until", [](options& o) -> float& { return o.resolution.quarter_until; }),
      named("resolution.half_until", [](options& o) -> float& { return o.resolution.half_until; }),
      named("resolution.least", [](options& o) -> int& { return o.resolution.least; }),
      named("resolution.long_run", [](options& o) -> int& { return o.resolution.long_run; }),
      named("sh_every", [](options& o) -> int& { return o.sh_every; }),
      named("rates.mean", [](options& o) -> float& { return o.rates.mean; }),
      named("rates.mean_final", [](options& o) -> float& { return o.rates.mean_final; }),
      named("rates.log_scale", [](options& o) -> float& { return o.rates.log_scale; }),
      named("rates.quaternion", [](options& o) -> float& { return o.rates.quaternion; }),
      named("rates.opacity", [](options& o) -> float& { return o.rates.opacity; }),
      named("rates.sh_dc", [](options& o) -> float& { return o.rates.sh_dc; }),
      named("rates.sh_rest", [](options& o) -> float& { return o.rates.sh_rest; }),
      named("rates.settled", [](options& o) -> float& { return o.rates.settled; }),
      named("rates.settle_late", [](options& o) -> float& { return o.rates.settle_late; }),
      named("rates.long_run", [](options& o) -> int& { return o.rates.long_run; }),
      named("rates.exposure", [](options& o) -> float& { return o.rates.exposure; }),
      named("rates.vignetting", [](options& o) -> float& { return o.rates.vignetting; }),
      named("rates.vignetting_final", [](options& o) -> float& { return o.rates.vignetting_final; }),
      named("poses.warm_up", [](options& o) -> float& { return o.poses.warm_up; }),
      named("poses.until", [](options& o) -> float& { return o.poses.until; }),
      named("poses.rate", [](options& o) -> float& { return o.poses.rate; }),
      named("poses.rate_final", [](options& o) -> float& { return o.poses.rate_final; }),
      named("poses.damping", [](options& o) -> float& { return o.poses.damping; }),
      named("poses.damping_final", [](options& o) -> float& { return o.poses.damping_final; }),
      named("poses.prior", [](options& o) -> float& { return o.poses.prior; }),
      named("lens.warm_up", [](options& o) -> float& { return o.lens.warm_up; }),
      named("lens.until", [](options& o) -> float& { return o.lens.until; }),
      named("lens.rate", [](options& o) -> float& { return o.lens.rate; }),
      named("lens.rate_final", [](options& o) -> float& { return o.lens.rate_final; }),
      named("error.from", [](options& o) -> int& { return o.error.from; }),
      named("error.every", [](options& o) -> int& { return o.error.every; }),
      named("error.fill", [](options& o) -> float& { return o.error.fill; }),
      named("error.until", [](options& o) -> float& { return o.error.until; }),
      named("error.dead_opacity", [](options& o) -> float& { return o.error.dead_opacity; }),
      named("error.opacity_penalty", [](options& o) -> float& { return o.error.opacity_penalty; }),
      named("error.split.share", [](options& o) -> float& { return o.error.split.share; }),
      named("error.split.opacity", [](options& o) -> float& { return o.error.split.opacity; }),
      named("error.pixels_each", [](options& o) -> float& { return o.error.pixels_each; }),
      named("error.least_budget", [](options& o) -> int& { return o.error.least_budget; }),
      named("mcmc.growth", [](options& o) -> float& { return o.mcmc.growth; }),
      named("mcmc.noise", [](options& o) -> float& { return o.mcmc.noise; }),
      named("mcmc.opacity_penalty", [](options& o) -> float& { return o.mcmc.opacity_penalty; }),
      named("mcmc.scale_penalty", [](options& o) -> float& { return o.mcmc.scale_penalty; }),
      named("adc.gradient", [](options& o) -> float& { return o.adc.gradient; }),
      named("adc.until", [](options& o) -> float& { return o.adc.until; }),
      named("adc.opacity_reset_every", [](options& o) -> int& { return o.adc.opacity_reset_every; }),
  };
  return all;
}

}  // namespace

void set_fields(options& o, std::string const& settings) {
  std::istringstream list(settings);
  for (std::string one; std::getline(list, one, ',');) {
    std::size_t const equals = one.find('=');
    std::string const name = one.substr(0, equals), value = equals == std::string::npos ? "" : one.substr(equals + 1);
    auto const found = std::find_if(fields().begin(), fields().end(), [&](field const& f) { return f.name == name; });
    if (found == fields().end()) {
      std::string names;
      for (field const& f : fields()) names += std::string(names.empty() ? "" : ", ") + f.name;
      throw usage_error("--set " + one + ": no such field; there are " + names);
    }
    char* end = nullptr;
    double const number = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0' || !std::isfinite(number))
      throw usage_error("--set " + one + ": a finite number belongs after " + name + "=");
    found->set(o, number);
  }
}

std::string with_field(std::string const& settings, std::string const& name, std::string const& value) {
  std::string others;
  std::istringstream list(settings);
  for (std::string one; std::getline(list, one, ',');)
    if (one.substr(0, one.find('=')) != name) others += "," + one;
  return name + "=" + value + others;
}

bool sets_field(std::string const& settings, std::string const& name) {
  return ("," + settings).find("," + name + "=") != std::string::npos;
}

}  // namespace gart_cli
