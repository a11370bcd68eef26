#pragma once
// What the parts of the module share: a file binds what its name says.

#include "arrays.hpp"

#include <gart/io/dataset.hpp>
#include <gart/render/options.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/renderer.hpp>

#include <memory>
#include <mutex>
#include <string>

namespace gart_python {

void bind_errors(py::module_& m);
void bind_scene(py::module_& m);
void bind_dataset(py::module_& m);
void bind_options(py::module_& m);
void bind_session(py::module_& m);
void bind_reference(py::module_& m);

// The Gaussians of a model as numpy arrays that `owner` keeps, by the names of scene/parameter_table.hpp.
py::object shown_parameter(gart::gaussian_model const& model, char const* name, py::handle owner);
gart::gaussian_model model_of(py::handle mean, py::handle log_scale, py::handle quaternion, py::handle opacity,
                              py::handle sh, char const* call);
// The degree of that many coefficients a channel; invalid_argument where it is none.
int degree_of(std::int64_t coefficients, char const* name);

// A pinhole camera, or any by COLMAP's name of its model.
gart::camera camera_of(int width, int height, double fx, double fy, std::optional<double> cx, std::optional<double> cy,
                       py::object const& c2w, std::string const& model, py::kwargs const& lens);

// The request that keyword arguments make. Errors: TypeError for another name.
gart::configuration_request request_of(py::kwargs const& given, char const* call);
py::dict as_dict(gart::configuration_info const& info);

// Sets attributes by name: "rates.mean" is one of a member. Errors: TypeError for a name that there is not.
void set_attributes(py::handle object, py::kwargs const& given);
// `given` over the options, or over their defaults.
gart::render_options options_of(py::handle options, py::kwargs const& given, gart::render_options const& otherwise);

// One caller at a time, and other Python threads go on.
template <class F>
decltype(auto) without_gil(std::mutex& mutex, F&& f) {
  py::gil_scoped_release released;
  std::lock_guard<std::mutex> const one(mutex);
  return f();
}

// The name of an argument that is an array. None comes too, and is refused by name.
inline auto array_arg(char const* name) { return py::arg(name).none(); }

// What a value holds. Errors: TypeError, by what is wanted of it.
template <class T>
T taken(py::handle value, std::string const& name) {
  try {
    return py::cast<T>(value);
  } catch (py::cast_error const&) {
    throw py::type_error(name + " cannot be " + py::cast<std::string>(py::repr(value)));
  }
}

// A renderer and what it was lent.
struct python_renderer {
  python_renderer(py::object const& model, py::kwargs const& given);

  std::unique_ptr<gart::renderer> it;
  gart::configuration_request request;
  place where;
  gart::render_options usual;  // of the model that was set
  std::int64_t count = 0;      // of Gaussians
  std::int64_t features = 0;   // of each
  std::vector<lent> bound;     // their arrays, where they are somebody else's
  lent bound_features;         // the same
  std::mutex mutex;
};

using renderer_class = py::class_<python_renderer, std::shared_ptr<python_renderer>>;
renderer_class bind_renderer(py::module_& m);
void bind_contexts(py::module_& m, renderer_class& renderer);

constexpr char const* parameter_names[] = {"mean", "log_scale", "quaternion", "opacity", "sh"};

// The arrays of Model, of one number of Gaussians (-1: any), with what keeps them.
template <class T>
gart::gaussians_view<T> parameters_of(std::array<py::object, 5> const& given, std::string const& call, std::int64_t n,
                                      place const& where, std::vector<lent>& kept) {
  std::vector<std::int64_t> const shapes[] = {{-1, 3}, {-1, 3}, {-1, 4}, {-1}, {-1, -1, 3}};
  kept.clear();
  for (std::size_t k = 0; k < 5; ++k) {
    std::string const name = call + ": " + parameter_names[k];
    std::vector<std::int64_t> shape = shapes[k];
    shape[0] = n;
    kept.push_back(lent::of<float>(given[k], {name.c_str(), std::move(shape), !std::is_const_v<T>}, where));
    n = kept[0].shape()[0];
  }
  gart::require_count(static_cast<std::size_t>(n));
  gart::gaussians_view<T> out;
  out.mean = kept[0].data<float>(), out.log_scale = kept[1].data<float>(), out.quaternion = kept[2].data<float>();
  out.opacity = kept[3].data<float>(), out.sh = kept[4].data<float>();
  out.count = static_cast<gart::index_t>(n), out.sh_degree = degree_of(kept[4].shape()[1], (call + ": sh").c_str());
  return out;
}

// Images of a view in memory of the policy: colour, transmittance, depth, hits, rgba, features; each may be None.
gart::render_targets targets_of(python_renderer const& r, gart::camera const& view, std::string const& call,
                                std::array<py::object, 6> const& given, std::vector<lent>& kept);

}  // namespace gart_python
