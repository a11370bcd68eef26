// Training.
#include "bindings.hpp"

#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/evaluate.hpp>
#include <gart/runtime/session.hpp>

#include <limits>

namespace gart_python {

namespace {

using shared_dataset = std::shared_ptr<gart::dataset>;

struct python_session {
  python_session(shared_dataset const& over, py::object const& options, py::object const& start,
                 py::kwargs const& given);

  shared_dataset data;  // outlives the session
  std::unique_ptr<gart::session> it;
  gart::train_options options;
  int kernel_degree = 2;
  std::mutex mutex;
};
using self = python_session;

gart::train_options train_options_of(py::object const& given, char const* name) {
  return given.is_none() ? gart::train_options{} : taken<gart::train_options>(given, name);
}

python_session::python_session(shared_dataset const& over, py::object const& given_options, py::object const& start,
                               py::kwargs const& given)
    : data(over), options(train_options_of(given_options, "Session: options")) {
  gart::configuration_request request = request_of(given, "Session");
  auto const* const file = start.is_none() ? nullptr : &taken<gart::model_file const&>(start, "Session: start");
  if (file && !given.contains("sh_degree")) request.sh_degree = file->model.sh_degree;
  kernel_degree = request.kernel_degree;
  py::gil_scoped_release released;
  gart::gaussian_model from;  // where the capture is
  if (file) from = file->model, gart::move_origin(from, file->origin, data->origin);
  it = gart::make_session(request, options, *data, file ? &from : nullptr);
}

gart::step_report step(self& s, int steps) {
  if (steps < 1) throw gart::invalid_argument("Session.step: steps must be at least 1");
  return without_gil(s.mutex, [&] {
    for (int k = 1; k < steps; ++k) s.it->step();
    return s.it->step();
  });
}

std::shared_ptr<gart::model_file> model(self& s) {
  auto out = std::make_shared<gart::model_file>();
  without_gil(s.mutex, [&] { out->model = s.it->model(); });
  out->render = gart::render_options_of(s.options, s.data->extent), out->kernel_degree = s.kernel_degree;
  out->total = out->model.size(), out->origin = s.data->origin;
  return out;
}

py::dict as_dict(gart::scores const& s) {
  py::dict out;
  out["psnr"] = s.psnr, out["ssim"] = s.ssim;
  py::list views;
  for (auto const& v : s.views) {
    py::dict one;
    one["name"] = v.name, one["psnr"] = v.psnr, one["ssim"] = v.ssim, one["milliseconds"] = v.milliseconds;
    views.append(one);
  }
  out["views"] = views;
  return out;
}

gart::vec3 color_of(std::array<float, 3> const& c) { return {c[0], c[1], c[2]}; }

py::dict evaluate(self& s, bool test, std::array<float, 3> const& background) {
  auto const& views = test ? s.data->test : s.data->train;
  gart::scores const found = without_gil(s.mutex, [&] {
    gart::vec3 const behind = color_of(background);
    return gart::evaluate(gart::all_of(views), behind, s.it->exposures(),
                          [&](gart::camera const& view) { return s.it->render(s.it->as_learned(view), behind); });
  });
  return as_dict(found);
}

py::dict evaluate_renderer(python_renderer& r, std::vector<std::shared_ptr<gart::dataset_view>> const& views,
                           py::object const& options, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r.usual);
  gart::some_views all;
  for (auto const& v : views) all.push_back(v.get());
  gart::scores const found = without_gil(r.mutex, [&] {
    return gart::evaluate(all, o.background, {}, [&](gart::camera const& view) { return r.it->render(view, o); });
  });
  return as_dict(found);
}

std::pair<gart::train_options, py::dict> recommended(shared_dataset const& data, py::object const& options,
                                                     py::kwargs const& given) {
  gart::train_options const base = train_options_of(options, "recommended: options");
  gart::configuration_request const request = request_of(given, "recommended");
  gart::recommendation found;
  {
    py::gil_scoped_release released;
    found = gart::recommended(base, *data, request);
  }
  py::dict out;
  for (auto const& [key, value] : given) out[key] = value;
  out["backend"] = to_string(found.request.backend), out["tracer"] = to_string(found.request.tracer);
  out["backward"] = found.request.backward, out["sh_degree"] = found.request.sh_degree;
  return {found.options, out};
}

char const class_text[] = R"(A training run.

Session(dataset, options=None, start=None, *, backend="auto", ...): arguments past start as of Renderer. start is a
Model to begin with, else the dataset's points or random ones. Calls drop the interpreter's lock.)";

}  // namespace

void bind_session(py::module_& m) {
  py::class_<gart::step_report>(m, "StepReport", "What a step says of itself.")
      .def_ro("step", &gart::step_report::step, "steps done, this one included")
      .def_ro("loss", &gart::step_report::loss, "of this step's view")
      .def_ro("psnr", &gart::step_report::psnr, "of this step's view, dB")
      .def_ro("gaussians", &gart::step_report::gaussians, "after the step")
      .def_ro("view", &gart::step_report::view, "its name")
      .def_ro("backward", &gart::step_report::backward, "the strategy of this step")
      .def_ro("skipped", &gart::step_report::skipped, "with check_finite: numbers that Adam left as they were")
      .def("__repr__", [](gart::step_report const& r) {
        return "gart.StepReport(step=" + std::to_string(r.step) + ", loss=" + std::to_string(r.loss) +
               ", psnr=" + std::to_string(r.psnr) + ", gaussians=" + std::to_string(r.gaussians) + ")";
      });
  py::class_<self>(m, "Session", class_text)
      .def(py::init<shared_dataset const&, py::object const&, py::object const&, py::kwargs const&>(),
           py::arg("dataset"), py::arg("options") = py::none(), py::arg("start") = py::none(), py::others("request"))
      .def("step", &step, py::arg("steps") = 1, "Steps of training; the report of the last.")
      .def_prop_ro(
          "steps_done", [](self const& s) { return s.it->steps_done(); },
          "Of this run and, where it was resumed, of those before.")
      .def(
          "set_iterations", [](self& s, int n) { without_gil(s.mutex, [&] { s.it->set_iterations(n); }); },
          py::arg("iterations"), "The length that rates, degrees and densification go by from the next step on.")
      .def("__len__", [](self const& s) { return s.it->size(); })
      .def("model", &model, "The Gaussians as a Model of their own, with what they were trained to be rendered with.")
      .def(
          "save_model",
          [](self& s, std::filesystem::path const& path) {
            without_gil(s.mutex, [&] {
              auto const traits = gart::traits_of(gart::render_options_of(s.options, s.data->extent), s.kernel_degree);
              s.it->save_model(path, traits);
            });
          },
          py::arg("path"), "Writes the Gaussians in the format that the ending says.\n\nRaises IoError.")
      .def(
          "save", [](self& s, std::filesystem::path const& p) { without_gil(s.mutex, [&] { s.it->save(p); }); },
          py::arg("path"), "Writes a checkpoint, whole or not at all.\n\nRaises IoError.")
      .def(
          "load", [](self& s, std::filesystem::path const& p) { without_gil(s.mutex, [&] { s.it->load(p); }); },
          py::arg("path"), "Takes up the run of a checkpoint.\n\nRaises IoError.")
      .def(
          "render",
          [](self& s, gart::camera const& view, std::array<float, 3> const& background) {
            gart::rendered image = without_gil(s.mutex, [&] { return s.it->render(view, color_of(background)); });
            py::dict out;
            out["color"] = image_array(std::move(image.color));
            out["transmittance"] = image_array(std::move(image.transmittance));
            out["depth"] = image_array(std::move(image.depth));
            out["hits"] = image_array(std::move(image.hits));
            return out;
          },
          py::arg("camera"), py::arg("background") = std::array<float, 3>{0, 0, 0}, "As Renderer.render.")
      .def("evaluate", &evaluate, py::arg("test") = true, py::arg("background") = std::array<float, 3>{0, 0, 0},
           "Scores against the dataset's test or training views: {'psnr', 'ssim', 'views'}, means and each.")
      .def(
          "cameras",
          [](self& s) {
            py::list out;
            for (auto const& c : without_gil(s.mutex, [&] { return s.it->poses(); }))
              out.append(py::make_tuple(c.name, c.view));
            return out;
          },
          "(name, Camera) of the training views as they are learned; empty where neither poses nor lenses are.")
      .def_prop_ro(
          "options", [](self const& s) { return s.options; }, "a copy")
      .def_prop_ro("dataset", [](self const& s) { return s.data; })
      .def_prop_ro("configuration", [](self const& s) { return as_dict(s.it->configuration()); })
      .def_prop_ro("peak_bytes", [](self const& s) { return s.it->peak_bytes(); });
  m.def("evaluate", &evaluate_renderer, py::arg("renderer"), py::arg("views"), py::arg("options") = py::none(),
        py::others("settings"),
        R"(Scores of a renderer's model against photographs: {"psnr", "ssim", "views"}, means and each.

views  a list of View, as dataset.test; options as of Renderer.render)");
  m.def("recommended", &recommended, py::arg("dataset"), py::arg("options") = py::none(), py::others("request"),
        R"(What a capture asks for, measured in short trainings, as `gart train` takes it.

Returns TrainOptions and a dictionary of arguments for Session.)");
}

}  // namespace gart_python
