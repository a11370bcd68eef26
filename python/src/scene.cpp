// Cameras and models.
#include "bindings.hpp"

#include <gart/io/camera_file.hpp>

#include <cmath>
#include <cstring>

namespace gart_python {

namespace {

using pose = std::array<double, 16>;  // row-major, camera to world

pose pose_of(gart::camera const& c) {
  pose out{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      out[static_cast<std::size_t>(4 * row + column)] = static_cast<double>(c.rotation[column][row]);
    out[static_cast<std::size_t>(4 * row + 3)] = c.position[row];
  }
  out[15] = 1;
  return out;
}

// From any object that numpy can make a matrix of 3 or 4 rows of 4 of.
void set_pose(gart::camera& c, py::handle c2w) {
  py::object const numpy = py::imported("numpy");
  lent matrix;
  try {
    matrix = lent::of<double>(numpy.attr("ascontiguousarray")(c2w, "float64"), {"Camera: c2w", {-1, 4}});
  } catch (py::python_error const&) {
  } catch (gart::invalid_argument const&) {
  }
  if (matrix.shape().empty() || (matrix.shape()[0] != 3 && matrix.shape()[0] != 4))
    throw gart::invalid_argument("Camera: c2w must be a matrix of 4 x 4 or 3 x 4 numbers, camera to world");
  double const* m = matrix.data<double>();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) c.rotation[column][row] = static_cast<float>(m[4 * row + column]);
    c.position[row] = m[4 * row + 3];
  }
}

char const camera_text[] = R"(A view's camera, in OpenCV's axes: x right, y down, z forward.

Camera(width, height, fx, fy, cx=None, cy=None, c2w=None, model="PINHOLE", **lens)

width, height   pixels
fx, fy          focal lengths in pixels
cx, cy          principal point in pixels, the middle of the image where not given; the centre of the first pixel is 0.5
c2w             [4, 4] or [3, 4], camera to world; the identity where not given
model, lens     a lens by COLMAP's name and parameters: model="OPENCV", k1=..., k2=..., p1=..., p2=...)";

char const model_text[] = R"(N Gaussians of SH degree D with K = (D + 1)^2 coefficients a channel.

Model(mean, log_scale, quaternion, opacity, sh) copies float32 arrays of the host:

mean        [N, 3]     world units
log_scale   [N, 3]     natural logarithm of the standard deviations
quaternion  [N, 4]     w, x, y, z; any norm
opacity     [N]        logit
sh          [N, K, 3]  coefficients; colour = max(0, 0.5 + sum_k sh_k Y_k(direction))

The attributes of these names are numpy arrays of the model's own memory: what is written to them counts.)";

}  // namespace

int degree_of(std::int64_t coefficients, char const* name) {
  for (int degree = 0; degree <= 3; ++degree)
    if (gart::sh_coefficients(degree) == coefficients) return degree;
  throw gart::invalid_argument(std::string(name) + " must have 1, 4, 9 or 16 coefficients a channel, not " +
                               std::to_string(coefficients));
}

py::object shown_parameter(gart::gaussian_model const& model, char const* name, py::handle owner) {
  py::object out;
  gart::for_each_array(
      [&](gart::parameter_array const& a, auto const& values) {
        if (std::strcmp(a.name, name) != 0) return;
        std::vector<std::int64_t> shape{static_cast<std::int64_t>(model.size())};
        if (a.number == gart::sh_array)
          shape.insert(shape.end(), {gart::sh_coefficients(model.sh_degree), 3});
        else if (a.floats > 1)
          shape.push_back(a.floats);
        out = shown_array(shape, values.data(), owner);
      },
      model);
  return out;
}

gart::gaussian_model model_of(py::handle mean, py::handle log_scale, py::handle quaternion, py::handle opacity,
                              py::handle sh, char const* call) {
  auto const named = [&](char const* what) { return std::string(call) + ": " + what; };
  std::string const names[] = {named("mean"), named("log_scale"), named("quaternion"), named("opacity"), named("sh")};
  lent const of_mean = lent::of<float>(mean, {names[0].c_str(), {-1, 3}});
  std::int64_t const n = of_mean.shape()[0];
  lent const rest[] = {
      lent::of<float>(log_scale, {names[1].c_str(), {n, 3}}), lent::of<float>(quaternion, {names[2].c_str(), {n, 4}}),
      lent::of<float>(opacity, {names[3].c_str(), {n}}), lent::of<float>(sh, {names[4].c_str(), {n, -1, 3}})};
  gart::gaussian_model out;
  out.sh_degree = degree_of(rest[3].shape()[1], names[4].c_str());
  auto const copy = [](lent const& from, std::vector<float>& to) {
    to.assign(from.data<float>(), from.data<float>() + from.size());
  };
  copy(of_mean, out.mean), copy(rest[0], out.log_scale), copy(rest[1], out.quaternion);
  copy(rest[2], out.opacity), copy(rest[3], out.sh);
  return out;
}

gart::camera camera_of(int width, int height, double fx, double fy, std::optional<double> cx, std::optional<double> cy,
                       py::object const& c2w, std::string const& model, py::kwargs const& lens) {
  gart::camera c;
  if (model != "PINHOLE" || lens.size() > 0) {
    // As a file has it, so that names and ranges are the library's.
    py::dict record;
    record["width"] = width, record["height"] = height, record["fx"] = fx, record["fy"] = fy;
    record["cx"] = cx.value_or(width / 2.0), record["cy"] = cy.value_or(height / 2.0);
    record["camera_model"] = model;
    record["c2w"] = py::imported("json").attr("loads")("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]");
    for (auto const& [name, value] : lens) record[name] = value;
    auto const text = py::cast<std::string>(py::imported("json").attr("dumps")(record));
    c = gart::parse_camera_json(text, "Camera").view;
  } else {
    if (width < 1 || height < 1 || width > 1000000 || height > 1000000)
      throw gart::invalid_argument("Camera: width and height must be 1 to 1000000 pixels");
    if (!(fx > 0 && fy > 0 && std::isfinite(fx) && std::isfinite(fy)))
      throw gart::invalid_argument("Camera: fx and fy must be positive and finite");
    c.width = width, c.height = height;
    c.fx = static_cast<float>(fx), c.fy = static_cast<float>(fy);
    c.cx = static_cast<float>(cx.value_or(width / 2.0)), c.cy = static_cast<float>(cy.value_or(height / 2.0));
  }
  if (!c2w.is_none()) set_pose(c, c2w);
  return c;
}

void bind_scene(py::module_& m) {
  py::class_<gart::camera>(m, "Camera", camera_text)
      .def(py::made_by(&camera_of), py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"),
           py::arg("cx") = py::none(), py::arg("cy") = py::none(), py::arg("c2w") = py::none(),
           py::arg("model") = "PINHOLE", py::others("lens"))
      .def_rw("width", &gart::camera::width, "pixels")
      .def_rw("height", &gart::camera::height, "pixels")
      .def_rw("fx", &gart::camera::fx, "pixels")
      .def_rw("fy", &gart::camera::fy, "pixels")
      .def_rw("cx", &gart::camera::cx, "pixels")
      .def_rw("cy", &gart::camera::cy, "pixels")
      .def_prop_rw(
          "c2w",
          [](gart::camera const& c) {
            return owned_array({4, 4}, std::vector<double>([&] {
                                 pose const p = pose_of(c);
                                 return std::vector<double>(p.begin(), p.end());
                               }()));
          },
          &set_pose, "camera to world, float64 [4, 4]; reading makes a copy")
      .def_prop_ro(
          "model", [](gart::camera const& c) { return gart::fields_of(c).model; },
          "COLMAP's name of the camera's model")
      .def_prop_ro(
          "parameters",
          [](gart::camera const& c) {
            py::dict out;
            for (auto const& [name, value] : gart::fields_of(c).values) out[name.c_str()] = value;
            return out;
          },
          "all parameters of the model by COLMAP's names")
      .def(
          "resized", [](gart::camera const& c, int width, int height) { return gart::resized(c, width, height); },
          py::arg("width"), py::arg("height"), "The same camera for an image of another size.")
      .def(
          "json",
          [](gart::camera const& c) {
            return gart::camera_json({"", c});
          },
          "As `gart render --cameras` reads it: one object of a camera JSON.")
      .def_static(
          "from_json", [](std::string const& text) { return gart::parse_camera_json(text, "Camera.from_json").view; },
          py::arg("text"))
      .def("__copy__", [](gart::camera const& c) { return c; })
      .def("__repr__", [](gart::camera const& c) {
        return "gart.Camera(" + std::to_string(c.width) + " x " + std::to_string(c.height) + ", " +
               gart::fields_of(c).model + ")";
      });

  using file = gart::model_file;
  py::class_<file, std::shared_ptr<file>> model(m, "Model", model_text);
  model
      .def(py::made_by([](py::object const& mean, py::object const& log_scale, py::object const& quaternion,
                          py::object const& opacity, py::object const& sh, int kernel_degree,
                          py::object const& features) {
             file out;
             out.model = model_of(mean, log_scale, quaternion, opacity, sh, "Model");
             out.total = out.model.size(), out.kernel_degree = kernel_degree;
             if (!features.is_none()) {
               auto const n = static_cast<std::int64_t>(out.model.size());
               lent const given = lent::of<float>(features, {"Model: features", {n, -1}});
               out.model.features.assign(given.data<float>(), given.data<float>() + given.size());
               out.model.feature_count = static_cast<int>(given.shape()[1]);
             }
             return out;
           }),
           array_arg("mean"), array_arg("log_scale"), array_arg("quaternion"), array_arg("opacity"), array_arg("sh"),
           py::arg("kernel_degree") = 2, py::arg("features") = py::none())
      .def_prop_ro(
          "features",
          [](py::object const& self) -> py::object {
            gart::gaussian_model const& m = py::cast<file const&>(self).model;
            if (m.feature_count == 0) return py::none();
            return shown_array({static_cast<std::int64_t>(m.size()), m.feature_count}, m.features.data(), self);
          },
          "float32 [N, F], in PLY alone; None where there are none")
      .def("__len__", [](file const& f) { return f.model.size(); })
      .def_prop_ro("sh_degree", [](file const& f) { return f.model.sh_degree; })
      .def_ro("kernel_degree", &file::kernel_degree, "2: Gaussians")
      .def_prop_ro(
          "origin",
          [](file const& f) {
            return std::array{f.origin.x, f.origin.y, f.origin.z};
          },
          "what coordinates are relative to")
      .def_rw("render", &file::render, "what the model was trained to be rendered with")
      .def_ro("notes", &file::notes, "a line for each kind of Gaussian that was left out of the file")
      .def(
          "with_sh_degree",
          [](file const& f, int degree) {
            file out = f;
            out.model = gart::with_sh_degree(f.model, degree);
            return std::make_shared<file>(std::move(out));
          },
          py::arg("degree"), "A copy; coefficients past the degree are dropped, missing ones are zero.")
      .def("__repr__", [](file const& f) {
        return "gart.Model(" + std::to_string(f.model.size()) + " Gaussians, SH degree " +
               std::to_string(f.model.sh_degree) + ")";
      });
  for (char const* name : {"mean", "log_scale", "quaternion", "opacity", "sh"})
    model.def_prop_ro(name, [name](py::object const& self) {
      return shown_parameter(py::cast<file const&>(self).model, name, self);
    });

  m.def(
      "load_model",
      [](std::filesystem::path const& path) {
        py::gil_scoped_release released;
        return std::make_shared<file>(gart::load_model(path));
      },
      py::arg("path"),
      "A model from a file of any format of docs/formats.md, known by its first bytes.\n\nRaises IoError.");
  m.def(
      "save_model",
      [](std::filesystem::path const& path, file const& given) {
        py::gil_scoped_release released;
        gart::save_model(path, given);
      },
      py::arg("path"), py::arg("model"),
      "Writes a model in the format that the ending says, to a temporary name, then renamed.\n\nRaises IoError.");
}

}  // namespace gart_python
