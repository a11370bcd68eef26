// Images and gradients by their definition, in double.
#include "bindings.hpp"

#include <gart/reference/reference.hpp>

namespace gart_python {

namespace {

std::vector<double> values_of(py::handle argument, wanted const& w) {
  lent const given = lent::if_given<double>(argument, w);
  return argument.is_none() ? std::vector<double>{}
                            : std::vector<double>(given.data<double>(), given.data<double>() + given.size());
}

py::dict reference(gart::model_file const& file, gart::camera const& view, py::object const& color,
                   py::object const& depth, py::object const& options, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, file.render);
  std::int64_t const h = view.height, w = view.width;
  auto const by_color = values_of(color, {"reference: color_gradient", {h, w, 3}});
  auto const by_depth = values_of(depth, {"reference: depth_gradient", {h, w}});
  gart::reference_image got;
  {
    py::gil_scoped_release released;
    got = gart::trace_reference(file.model, view, o, file.model.sh_degree, gart::all_pixels(view), by_color,
                                file.kernel_degree, by_depth);
  }
  py::dict out;
  out["color"] = owned_array({h, w, 3}, std::move(got.color));
  out["transmittance"] = owned_array({h, w}, std::move(got.transmittance));
  out["depth"] = owned_array({h, w}, std::move(got.depth));
  out["hits"] = owned_array({h, w}, std::move(got.hits));
  if (!color.is_none()) {
    auto const n = static_cast<std::int64_t>(file.model.size());
    gart::reference_gradients& g = got.gradients;
    py::dict gradients;
    gradients["mean"] = owned_array({n, 3}, std::move(g.mean));
    gradients["log_scale"] = owned_array({n, 3}, std::move(g.log_scale));
    gradients["quaternion"] = owned_array({n, 4}, std::move(g.quaternion));
    gradients["opacity"] = owned_array({n}, std::move(g.opacity));
    gradients["sh"] = owned_array({n, gart::sh_coefficients(g.sh_degree), 3}, std::move(g.sh));
    out["gradients"] = gradients;
  }
  return out;
}

}  // namespace

void bind_reference(py::module_& m) {
  m.def("reference", &reference, py::arg("model"), py::arg("camera"), py::arg("color_gradient") = py::none(),
        py::arg("depth_gradient") = py::none(), py::arg("options") = py::none(), py::others("settings"),
        R"(An image by its definition, in double, for tests: slow, and it shares no code with the renderer.

As Renderer.render, in float64; with color_gradient, float64 [H, W, 3], also "gradients" by the model's arrays.)");
}

}  // namespace gart_python
