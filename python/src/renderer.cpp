// The renderer, and tracking by it.
#include "bindings.hpp"

#include <gart/runtime/track.hpp>

#include <algorithm>

namespace gart_python {

namespace {

using self = python_renderer;

template <class E>
E named(py::handle value, std::string const& argument) {
  return gart::from_string<E>(taken<std::string>(value, argument));
}

void set_model(self& r, gart::model_file const& file) {
  std::vector<lent> let_go;
  lent features;
  without_gil(r.mutex, [&] {
    r.it->set_model(file.model);
    std::swap(r.bound, let_go), std::swap(r.bound_features, features);
    r.usual = file.render, r.count = static_cast<std::int64_t>(file.model.size());
    r.features = file.model.feature_count;
  });
}

void bind(self& r, std::array<py::object, 5> const& arrays) {
  std::vector<lent> kept;
  lent features;
  auto const view = parameters_of<float const>(arrays, "Renderer.bind", -1, r.where, kept);
  without_gil(r.mutex, [&] {
    r.it->bind(view);
    std::swap(r.bound, kept);  // what was bound goes with the interpreter's lock held
    std::swap(r.bound_features, features);
    r.count = view.count, r.features = 0;
  });
}

void bind_features(self& r, py::object const& array) {
  lent features = lent::if_given<float>(array, {"Renderer.bind_features: features", {r.count, -1}}, r.where);
  int const width = features.data<float>() ? static_cast<int>(features.shape()[1]) : 0;
  without_gil(r.mutex, [&] {
    r.it->bind_channels({{features.data<float>(), static_cast<gart::index_t>(r.count), width}});
    std::swap(r.bound_features, features);
    r.features = width;
  });
}

py::dict render(self& r, gart::camera const& view, py::object const& options, bool features, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r.usual);
  gart::rendered image = without_gil(r.mutex, [&] { return r.it->render(view, o, features); });
  py::dict out;
  std::int64_t const width = image.features.channels;
  if (!image.features.data.empty())
    out["features"] = owned_array({view.height, view.width, width}, std::move(image.features.data));
  out["color"] = image_array(std::move(image.color));
  out["transmittance"] = image_array(std::move(image.transmittance));
  out["depth"] = image_array(std::move(image.depth));
  out["hits"] = image_array(std::move(image.hits));
  return out;
}

py::object render_8bit(self& r, gart::camera const& view, py::object const& options, py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r.usual);
  return image_array(without_gil(r.mutex, [&] { return r.it->render_8bit(view, o); }));
}

void render_to(self& r, gart::camera const& view, py::object const& options, std::array<py::object, 6> const& targets,
               py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r.usual);
  std::vector<lent> kept;
  gart::render_targets const to = targets_of(r, view, "Renderer.render_to", targets, kept);
  without_gil(r.mutex, [&] { r.it->render_to(view, o, to); });
}

py::dict as_arrays(gart::pose_gradient const& g) {
  py::dict out;
  out["translation"] = owned_array({3}, std::vector<double>{g.translation.x, g.translation.y, g.translation.z});
  out["rotation"] = owned_array({3}, std::vector<double>{g.rotation.x, g.rotation.y, g.rotation.z});
  return out;
}

// From an array of the host to numpy arrays.
py::dict backward(self& r, gart::camera const& view, py::object const& color, py::object const& options, bool pose,
                  py::kwargs const& given) {
  gart::render_options const o = options_of(options, given, r.usual);
  lent const by = lent::of<float>(color, {"Renderer.backward: color_gradient", {view.height, view.width, 3}});
  gart::pose_gradient turned;
  gart::gaussian_model got = without_gil(r.mutex, [&] {
    gart::image_float gradient(view.width, view.height, 3);
    std::copy_n(by.data<float>(), by.size(), gradient.data.data());
    r.it->differentiate(view, o, gradient);
    if (pose) turned = r.it->differentiate_pose();
    return r.it->gradients();
  });
  py::dict out;
  auto const n = static_cast<std::int64_t>(got.size());
  out["mean"] = owned_array({n, 3}, std::move(got.mean));
  out["log_scale"] = owned_array({n, 3}, std::move(got.log_scale));
  out["quaternion"] = owned_array({n, 4}, std::move(got.quaternion));
  out["opacity"] = owned_array({n}, std::move(got.opacity));
  out["sh"] = owned_array({n, gart::sh_coefficients(got.sh_degree), 3}, std::move(got.sh));
  if (pose) out["pose"] = as_arrays(turned);
  return out;
}

gart::image_float photo_of(py::handle photo, gart::camera const& view) {
  std::int64_t const h = view.height, w = view.width;
  gart::image_float out(view.width, view.height, 3);
  lent const values = lent::of_either<gart::u8, float>(photo, {"track: photo", {h, w, 3}});
  if (values.holds<gart::u8>())
    for (std::size_t k = 0; k < values.size(); ++k)
      out.data[k] = static_cast<float>(values.data<gart::u8>()[k]) / 255.0f;
  else
    std::copy_n(values.data<float>(), values.size(), out.data.data());
  return out;
}

std::pair<gart::camera, std::vector<float>> track(self& r, py::object const& photo, gart::camera const& guess,
                                                  py::object const& options, int steps, float blur,
                                                  py::object const& mask, py::kwargs const& given) {
  gart::track_options o;
  o.render = options_of(options, given, r.usual), o.steps = steps, o.blur = blur;
  gart::image_float const image = photo_of(photo, guess);
  gart::image8 seen;
  if (!mask.is_none()) {
    lent const bytes = lent::of<gart::u8>(mask, {"track: mask", {guess.height, guess.width}});
    seen = gart::image8(guess.width, guess.height, 1);
    std::copy_n(bytes.data<gart::u8>(), bytes.size(), seen.data.data());
  }
  gart::track_result found = without_gil(r.mutex, [&] { return gart::track(*r.it, image, guess, o, seen); });
  return {found.view, std::move(found.residuals)};
}

char const class_text[] = R"(Renders and differentiates views of one model.

Renderer(model=None, *, backend="auto", tracer="auto", backward="auto", sh_degree=3, kernel_degree=2,
         hit_format="auto", depth=False, threads=0, device=0, stream=None)

The degrees are those of the model where one is given. depth=True gives gradients of depth and transmittance too.
stream is a cudaStream_t as a number, as torch.cuda.Stream.cuda_stream; without one work goes to the legacy default
stream.

Memory "of the policy" is memory of the CUDA device for backend "cuda", else of the host. Such arrays are any objects
with the buffer protocol or DLPack, and are never copied. On a device calls return before the work is done: what the
caller puts into the same stream comes after it, or wait().

Calls drop the interpreter's lock, and one renderer serves one thread at a time. RenderOptions may be given as options,
or by name: render(camera, background=(1, 1, 1)); without them they are those that the model's file says.)";

}  // namespace

python_renderer::python_renderer(py::object const& model, py::kwargs const& given)
    : request(request_of(given, "Renderer")) {
  auto const* const file = model.is_none() ? nullptr : &taken<gart::model_file const&>(model, "Renderer: model");
  if (file && !given.contains("sh_degree")) request.sh_degree = file->model.sh_degree;
  if (file && !given.contains("kernel_degree")) request.kernel_degree = file->kernel_degree;
  bool const on_device = gart::resolve(request).backend == gart::backend_kind::cuda;
  // Without a stream of its own the caller has the legacy default one, which others' work is in order with.
  if (on_device && !request.stream) request.stream = reinterpret_cast<void*>(std::uintptr_t{1});
  where = {on_device, request.device, request.stream};
  py::gil_scoped_release released;
  it = gart::make_renderer(request);
  if (!file) return;
  it->set_model(file->model), usual = file->render;
  count = std::int64_t(file->model.size()), features = file->model.feature_count;
}

gart::render_targets targets_of(python_renderer const& r, gart::camera const& view, std::string const& call,
                                std::array<py::object, 6> const& given, std::vector<lent>& kept) {
  std::int64_t const h = view.height, w = view.width;
  auto const name = [&](char const* what) { return call + ": " + what; };
  std::string const names[] = {name("color"), name("transmittance"), name("depth"),
                               name("hits"),  name("rgba"),          name("features")};
  kept.clear();
  kept.push_back(lent::if_given<float>(given[0], {names[0].c_str(), {h, w, 3}, true}, r.where));
  kept.push_back(lent::if_given<float>(given[1], {names[1].c_str(), {h, w}, true}, r.where));
  kept.push_back(lent::if_given<float>(given[2], {names[2].c_str(), {h, w}, true}, r.where));
  kept.push_back(lent::if_given<gart::u32>(given[3], {names[3].c_str(), {h, w}, true}, r.where));
  kept.push_back(lent::if_given<gart::u8>(given[4], {names[4].c_str(), {h, w, 4}, true}, r.where));
  kept.push_back(lent::if_given<float>(given[5], {names[5].c_str(), {h, w, r.features}, true}, r.where));
  return {kept[0].data<float>(),     kept[1].data<float>(),    kept[2].data<float>(),
          kept[3].data<gart::u32>(), kept[4].data<gart::u8>(), {kept[5].data<float>()}};
}

gart::configuration_request request_of(py::kwargs const& given, char const* call) {
  gart::configuration_request out;
  for (auto const& [key, value] : given) {
    auto const name = py::cast<std::string>(key), argument = std::string(call) + ": " + name;
    if (name == "backend")
      out.backend = named<gart::backend_kind>(value, argument);
    else if (name == "tracer")
      out.tracer = named<gart::tracer_kind>(value, argument);
    else if (name == "backward")
      out.backward = taken<std::string>(value, argument);
    else if (name == "sh_degree")
      out.sh_degree = taken<int>(value, argument);
    else if (name == "kernel_degree")
      out.kernel_degree = taken<int>(value, argument);
    else if (name == "hit_format")
      out.hit_format = named<gart::hit_format_kind>(value, argument);
    else if (name == "depth")
      out.depth = taken<bool>(value, argument);
    else if (name == "threads")
      out.threads = taken<int>(value, argument);
    else if (name == "device")
      out.device = taken<int>(value, argument);
    else if (name != "stream")
      throw py::type_error(std::string(call) + ": no argument '" + name +
                           "': there are backend, tracer, backward, sh_degree, kernel_degree, hit_format, depth, "
                           "threads, device, stream");
    else if (!value.is_none())
      // 0 is CUDA's legacy default stream, whose handle is 1.
      out.stream = reinterpret_cast<void*>(std::max<std::uintptr_t>(1, taken<std::uintptr_t>(value, argument)));
  }
  return out;
}

py::dict as_dict(gart::configuration_info const& info) {
  py::dict out;
  out["backend"] = to_string(info.backend), out["tracer"] = to_string(info.tracer);
  out["backward"] = info.backward, out["sh_degree"] = info.sh_degree, out["stored_degree"] = info.stored_degree;
  out["kernel_degree"] = info.kernel_degree, out["hit_format"] = to_string(info.hit_format);
  out["depth"] = info.depth, out["ranks"] = info.ranks, out["instruction_set"] = info.instruction_set;
  return out;
}

renderer_class bind_renderer(py::module_& m) {
  auto const none = py::none();
  renderer_class c(m, "Renderer", class_text);
  c.def(py::init<py::object const&, py::kwargs const&>(), py::arg("model") = none, py::others("request"))
      .def("set_model", &set_model, py::arg("model"), "Copies the model; arrays that were bound are let go.")
      .def(
          "bind",
          [](self& r, py::object a, py::object b, py::object c, py::object d, py::object e) {
            bind(r, {a, b, c, d, e});
          },
          array_arg("mean"), array_arg("log_scale"), array_arg("quaternion"), array_arg("opacity"), array_arg("sh"),
          R"(Takes float32 arrays in memory of the policy, of Model's shapes, without a copy.

They are kept until another model is set or bound. What is written to them between two views counts for the second.)")
      .def("bind_features", &bind_features, array_arg("features"),
           R"(Takes features of each Gaussian, float32 [N, F] in memory of the policy, 1 to 512 of each, without a copy.

They are kept until others are bound, None lets them go, or another model is set or bound.)")
      .def("render", &render, py::arg("camera"), py::arg("options") = none, py::kw_only(), py::arg("features") = false,
           py::others("settings"),
           R"(A view as a dictionary of new numpy arrays:

color          float32 [H, W, 3], background composited
transmittance  float32 [H, W]
depth          float32 [H, W], sum of weight * distance along the ray
hits           uint32 [H, W], Gaussians composited
features       float32 [H, W, F], sum of weight * features; with features=True, where there are any)")
      .def("render_8bit", &render_8bit, py::arg("camera"), py::arg("options") = none, py::others("settings"),
           "The colours of a view as a new numpy array, uint8 [H, W, 3].")
      .def(
          "render_to",
          [](self& r, gart::camera const& view, py::object const& options, py::object a, py::object b, py::object c,
             py::object d, py::object e, py::object f, py::kwargs const& given) {
            render_to(r, view, options, {a, b, c, d, e, f}, given);
          },
          py::arg("camera"), py::arg("options") = none, py::kw_only(), py::arg("color") = none,
          py::arg("transmittance") = none, py::arg("depth") = none, py::arg("hits") = none, py::arg("rgba") = none,
          py::arg("features") = none, py::others("settings"),
          "A view into memory of the policy, of render's shapes; rgba is uint8 [H, W, 4].")
      .def("backward", &backward, py::arg("camera"), array_arg("color_gradient"), py::arg("options") = none,
           py::kw_only(), py::arg("pose") = false, py::others("settings"),
           R"(Both passes of a view, for dL/dcolour as float32 [H, W, 3] on the host.

A dictionary of new numpy arrays, dL/d mean, log_scale, quaternion, opacity and sh of Model's shapes; with pose=True
also "pose", a dictionary of float64 [3]: "translation", by the camera's position, world units, and "rotation", by a
small turn w of the camera about its position, world axes: a direction d becomes d + w x d.)")
      .def(
          "wait", [](self& r) { without_gil(r.mutex, [&] { r.it->wait(); }); }, "Until all that was asked for is done.")
      .def(
          "profile",
          [](self& r, bool enable) {
            py::dict out;
            gart::profiler& times = without_gil(r.mutex, [&]() -> gart::profiler& { return r.it->profile(); });
            for (auto const& [label, time] : times.stages())
              out[label.c_str()] = py::make_tuple(time.milliseconds, time.launches);
            times.clear(), times.enable(enable);
            return out;
          },
          py::arg("enable") = true,
          "Times by stage since the last call, as (milliseconds, launches); from the first call on.")
      .def_prop_ro("configuration", [](self const& r) { return as_dict(r.it->configuration()); })
      .def_prop_ro(
          "peak_bytes", [](self const& r) { return r.it->peak_bytes(); },
          "Most bytes of the policy's memory that were in use at a time.")
      .def("__len__", [](self const& r) { return r.count; });

  m.def("track", &track, py::arg("renderer"), array_arg("photo"), py::arg("guess"), py::arg("options") = none,
        py::kw_only(), py::arg("steps") = 60, py::arg("blur") = 0.05f, py::arg("mask") = none, py::others("settings"),
        R"(Where a photograph was taken, from the renderer's model and a guess.

photo  float32 [H, W, 3] in [0, 1], or uint8, of the guess's size
mask   uint8 [H, W], 0 where it is not to be looked at
steps  images at most
blur   standard deviation of the first blur over the image's width; 0: none

Returns the camera that was found, and the root mean squared error after each step.)");
  m.def(
      "resolve", [](py::kwargs const& given) { return as_dict(gart::resolve(request_of(given, "resolve"))); },
      "The configuration that Renderer and Session would take for these arguments.");
  m.def(
      "configurations",
      [] {
        py::list out;
        for (auto const& one : gart::compiled_configurations()) out.append(as_dict(one));
        return out;
      },
      "All configurations that were compiled in.");
  return c;
}

}  // namespace gart_python
