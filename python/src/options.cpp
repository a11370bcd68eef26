// Options, as classes whose attributes are the library's fields.
#include "bindings.hpp"

#include <gart/train/options.hpp>

namespace gart_python {

namespace {

// Whether the class of an object has a field of that name.
bool has_field(py::handle object, std::string const& name) {
  py::handle const type = py::type::handle_of(object);
  if (!py::hasattr(type, name.c_str())) return false;
  return py::isinstance(type.attr(name.c_str()), py::module_::import("builtins").attr("property"));
}

std::string fields_of_class(py::handle object) {
  std::string out;
  for (auto const& name : py::module_::import("builtins").attr("dir")(py::type::of(object))) {
    auto const text = name.cast<std::string>();
    if (has_field(object, text)) out += (out.empty() ? "" : ", ") + text;
  }
  return out;
}

// An enumeration by its names.
template <class C, class Owner, class E>
void named_field(C& c, char const* name, E Owner::*member) {
  c.def_property(
      name, [member](Owner const& o) { return to_string(o.*member); },
      [member](Owner& o, std::string const& value) { o.*member = gart::from_string<E>(value); });
}

template <class T>
py::class_<T> options_class(py::module_& m, char const* name, char const* text) {
  py::class_<T> c(m, name, text);
  c.def(py::init([](py::kwargs const& given) {
    py::object made = py::cast(T{});
    set_attributes(made, given);
    return made.cast<T>();
  }));
  c.def("__repr__", [name](py::object const& self) {
    std::string out = std::string("gart.") + name + "(";
    bool first = true;
    for (auto const& one : py::module_::import("builtins").attr("dir")(py::type::of(self))) {
      auto const field = one.cast<std::string>();
      if (!has_field(self, field)) continue;
      out += (first ? "" : ", ") + field + "=" + std::string(py::repr(self.attr(field.c_str())));
      first = false;
    }
    return out + ")";
  });
  return c;
}

#define GART_FIELDS_1(c, T, f) c.def_readwrite(#f, &gart::T::f);
#define GART_FIELD(f) GART_FIELDS_1(c, GART_OWNER, f)

}  // namespace

void set_attributes(py::handle object, py::kwargs const& given) {
  for (auto const& [key, value] : given) {
    py::object owner = py::reinterpret_borrow<py::object>(object);
    auto name = key.cast<std::string>();
    for (std::size_t dot; (dot = name.find('.')) != std::string::npos; name = name.substr(dot + 1)) {
      if (!has_field(owner, name.substr(0, dot))) break;
      owner = owner.attr(name.substr(0, dot).c_str());
    }
    if (!has_field(owner, name))
      throw py::type_error("no option '" + key.cast<std::string>() + "': there are " + fields_of_class(owner));
    py::setattr(owner, name.c_str(), value);
  }
}

gart::render_options options_of(py::handle options, py::kwargs const& given, gart::render_options const& otherwise) {
  gart::render_options const base = options.is_none() ? otherwise : options.cast<gart::render_options>();
  if (given.empty()) return base;
  py::object const made = py::cast(base);
  set_attributes(made, given);
  return made.cast<gart::render_options>();
}

void bind_options(py::module_& m) {
  {
    auto c = options_class<gart::render_options>(m, "RenderOptions", R"(How one view is rendered.

alpha_min          a Gaussian is hit where its alpha is at least this (1/255)
transmittance_min  a ray ends after the hit that brings the transmittance below this (1e-4)
near               hits lie beyond this distance along the ray, world units (0.01)
max_hits           a ray ends after so many hits; 0: no cap
antialias          standard deviation of the pixels' filter, in pixels; 0: none
rebuild_every      views between two builds of the bvh tracer's tree
background         three numbers behind the last hit)");
#define GART_OWNER render_options
    GART_FIELD(alpha_min)
    GART_FIELD(transmittance_min)
    GART_FIELD(near) GART_FIELD(max_hits) GART_FIELD(antialias) GART_FIELD(rebuild_every)
#undef GART_OWNER
        using triple = std::array<float, 3>;
    c.def_property(
        "background",
        [](gart::render_options const& o) {
          return triple{o.background.x, o.background.y, o.background.z};
        },
        [](gart::render_options& o, triple const& b) { o.background = gart::vec3(b[0], b[1], b[2]); });
  }
  {
    auto c = options_class<gart::resolution_options>(m, "ResolutionOptions", "The size of a step's images.");
#define GART_OWNER resolution_options
    GART_FIELD(quarter_until) GART_FIELD(half_until) GART_FIELD(least) GART_FIELD(long_run)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::approximation_options>(m, "ApproximationOptions", "What trades exactness for time.");
#define GART_OWNER approximation_options
    GART_FIELD(alpha_min)
    GART_FIELD(transmittance_min) GART_FIELD(max_hits) GART_FIELD(antialias) GART_FIELD(rebuild_every)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::learning_rates>(m, "LearningRates", "Adam's rates, by parameter.");
#define GART_OWNER learning_rates
    GART_FIELD(mean)
    GART_FIELD(mean_final)
    GART_FIELD(log_scale) GART_FIELD(quaternion) GART_FIELD(opacity) GART_FIELD(sh_dc) GART_FIELD(sh_rest)
        GART_FIELD(settled) GART_FIELD(long_run) GART_FIELD(settle_late) GART_FIELD(exposure) GART_FIELD(vignetting)
            GART_FIELD(vignetting_final)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::adam_options>(m, "AdamOptions", "Adam's constants.");
#define GART_OWNER adam_options
    GART_FIELD(sparse)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::pose_options>(m, "PoseOptions", "How poses of training views are learned.");
#define GART_OWNER pose_options
    GART_FIELD(warm_up)
    GART_FIELD(until)
    GART_FIELD(rate) GART_FIELD(rate_final) GART_FIELD(damping) GART_FIELD(damping_final) GART_FIELD(prior)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::lens_options>(m, "LensOptions", "How the lenses of a capture are learned.");
#define GART_OWNER lens_options
    GART_FIELD(warm_up) GART_FIELD(until) GART_FIELD(rate) GART_FIELD(rate_final)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::split_shape>(m, "SplitShape", "How one Gaussian becomes two along its longest axis.");
#define GART_OWNER split_shape
    GART_FIELD(share) GART_FIELD(opacity)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::error_growth_options>(m, "ErrorGrowthOptions", "Growth where the image's error is.");
#define GART_OWNER error_growth_options
    GART_FIELD(from)
    GART_FIELD(every)
    GART_FIELD(fill) GART_FIELD(until) GART_FIELD(dead_opacity) GART_FIELD(opacity_penalty) GART_FIELD(split)
        GART_FIELD(pixels_each) GART_FIELD(least_budget)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::mcmc_options>(m, "McmcOptions", "Growth by Markov chain Monte Carlo.");
#define GART_OWNER mcmc_options
    GART_FIELD(from)
    GART_FIELD(every)
    GART_FIELD(until) GART_FIELD(growth) GART_FIELD(dead_opacity) GART_FIELD(noise) GART_FIELD(opacity_penalty)
        GART_FIELD(scale_penalty)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::adc_options>(m, "AdcOptions", "Adaptive density control.");
#define GART_OWNER adc_options
    GART_FIELD(from)
    GART_FIELD(every)
    GART_FIELD(opacity_reset_every) GART_FIELD(until) GART_FIELD(gradient) GART_FIELD(dense) GART_FIELD(prune_opacity)
#undef GART_OWNER
  }
  {
    auto c = options_class<gart::train_options>(m, "TrainOptions", R"(The options of a run; docs/training.md has each.

TrainOptions(iterations=2000, densify="mcmc", **{"rates.opacity": 0.05}) sets those that are named.)");
#define GART_OWNER train_options
    GART_FIELD(iterations)
    GART_FIELD(max_gaussians)
    GART_FIELD(random_points) GART_FIELD(sh_every) GART_FIELD(held_out) GART_FIELD(initial_opacity)
        GART_FIELD(initial_scale) GART_FIELD(ssim_weight) GART_FIELD(dropout) GART_FIELD(dropout_until)
            GART_FIELD(depth_weight) GART_FIELD(exposure) GART_FIELD(vignetting) GART_FIELD(refine_poses)
                GART_FIELD(refine_lens) GART_FIELD(lt_budget) GART_FIELD(check_finite) GART_FIELD(batch)
                    GART_FIELD(seed) GART_FIELD(near) GART_FIELD(resolution) GART_FIELD(render) GART_FIELD(rates)
                        GART_FIELD(adam) GART_FIELD(poses) GART_FIELD(lens) GART_FIELD(error) GART_FIELD(mcmc)
                            GART_FIELD(adc)
#undef GART_OWNER
                                named_field(c, "densify", &gart::train_options::densify);
    named_field(c, "background", &gart::train_options::background);
  }
}

}  // namespace gart_python
