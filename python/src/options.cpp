// Options, as classes whose attributes are the library's fields.
#include "bindings.hpp"

#include <gart/train/option_fields.hpp>

#include <string_view>
#include <variant>

namespace gart_python {

namespace {

// Whether the class of an object has a field of that name.
bool has_field(py::handle object, std::string const& name) {
  py::object const type = object.attr("__class__");
  if (!py::hasattr(type, name.c_str())) return false;
  return py::isinstance(type.attr(name.c_str()), py::imported("builtins").attr("property"));
}

std::string fields_of_class(py::handle object) {
  std::string out;
  py::object const names = py::imported("builtins").attr("dir")(object.attr("__class__"));
  for (py::handle const name : names) {
    auto const text = py::cast<std::string>(name);
    if (has_field(object, text)) out += (out.empty() ? "" : ", ") + text;
  }
  return out;
}

// An enumeration by its names.
template <class C, class Owner, class E>
void named_field(C& c, char const* name, E Owner::*member, char const* text) {
  c.def_prop_rw(
      name, [member](Owner const& o) { return to_string(o.*member); },
      [member](Owner& o, std::string const& value) { o.*member = gart::from_string<E>(value); }, text);
}

// What a train_options has by the table of its fields: those whose names begin so, as attributes.
struct option_group {
  py::object owner;    // keeps the options
  std::string prefix;  // "rates."

  gart::train_options& options() const { return py::cast<gart::train_options&>(owner); }
};

bool begins(std::string_view name, std::string_view prefix) { return name.substr(0, prefix.size()) == prefix; }

std::string field_names(std::string const& prefix) {
  std::string out;
  for (gart::option_field const& f : gart::option_fields)
    if (begins(f.name, prefix)) out += (out.empty() ? "" : ", ") + std::string(f.name.substr(prefix.size()));
  return out;
}

py::object get_field(option_group const& group, std::string const& name) {
  std::string const full = group.prefix + name;
  if (gart::option_field const* const f = gart::find_option_field(full)) {
    return std::visit([&](auto at) -> py::object { return py::cast(at(group.options())); }, f->of);
  }
  for (gart::option_field const& f : gart::option_fields)
    if (begins(f.name, full + ".")) return py::cast(option_group{group.owner, full + "."});
  throw py::attribute_error("no option '" + full + "': there are " + field_names(group.prefix));
}

bool set_field(option_group const& group, std::string const& name, py::handle value) {
  gart::option_field const* const f = gart::find_option_field(group.prefix + name);
  if (!f) return false;
  auto const number = taken<double>(value, "train_options." + std::string(f->name));
  if (!(number >= f->low && number <= f->high))
    throw gart::invalid_argument("train_options." + std::string(f->name) + " is " + gart::short_number(number) +
                                 ": from " + gart::short_number(f->low) + " to " + gart::short_number(f->high));
  f->set(group.options(), number);
  return true;
}

}  // namespace

void set_attributes(py::handle object, py::kwargs const& given) {
  for (auto const& [key, value] : given) {
    py::object owner = py::borrow(object);
    auto name = py::cast<std::string>(key);
    for (std::size_t dot; (dot = name.find('.')) != std::string::npos; name = name.substr(dot + 1)) {
      if (!has_field(owner, name.substr(0, dot))) break;
      owner = owner.attr(name.substr(0, dot).c_str());
    }
    if (!has_field(owner, name))
      throw py::type_error("no option '" + py::cast<std::string>(key) + "': there are " + fields_of_class(owner));
    py::setattr(owner, name.c_str(), value);
  }
}

gart::render_options options_of(py::handle options, py::kwargs const& given, gart::render_options const& otherwise) {
  gart::render_options const base = options.is_none() ? otherwise : taken<gart::render_options>(options, "options");
  if (given.size() == 0) return base;
  py::object const made = py::cast(base);
  set_attributes(made, given);
  return py::cast<gart::render_options>(made);
}

void bind_options(py::module_& m) {
  using render = gart::render_options;
  using triple = std::array<float, 3>;
  py::class_<render>(m, "RenderOptions",
                     R"(How one view is rendered: RenderOptions(near=0.1) sets what is named.

alpha_min          a Gaussian is hit where its alpha is at least this (1/255)
transmittance_min  a ray ends after the hit that brings the transmittance below this (1e-4)
near               hits lie beyond this distance along the ray, world units (0.01)
max_hits           a ray ends after so many hits; 0: no cap
antialias          standard deviation of the pixels' filter, in pixels; 0: none
rebuild_every      views between two builds of the bvh tracer's tree
background         three numbers behind the last hit)")
      .def(py::made_by([](py::kwargs const& given) { return options_of(py::none(), given, {}); }))
      .def_rw("alpha_min", &render::alpha_min)
      .def_rw("transmittance_min", &render::transmittance_min)
      .def_rw("near", &render::near)
      .def_rw("max_hits", &render::max_hits)
      .def_rw("antialias", &render::antialias)
      .def_rw("rebuild_every", &render::rebuild_every)
      .def_prop_rw(
          "background",
          [](render const& o) {
            return triple{o.background.x, o.background.y, o.background.z};
          },
          [](render& o, triple const& b) { o.background = gart::vec3(b[0], b[1], b[2]); });

  using train = gart::train_options;
  py::class_<option_group>(m, "OptionGroup", "Some options of TrainOptions: options.rates has options.rates.mean.")
      .def("__getattr__", &get_field)
      .def("__setattr__",
           [](option_group const& g, std::string const& name, py::handle value) {
             if (!set_field(g, name, value))
               throw py::attribute_error("no option '" + g.prefix + name + "': there are " + field_names(g.prefix));
           })
      .def("__dir__", [](option_group const& g) {
        py::list out;
        for (gart::option_field const& f : gart::option_fields)
          if (begins(f.name, g.prefix)) out.append(std::string(f.name.substr(g.prefix.size())));
        return out;
      });
  py::class_<train> c(m, "TrainOptions",
                      R"(The options of a run, by the names of `gart train --set`; fields() has each.

TrainOptions(iterations=2000, densify="mcmc", **{"rates.opacity": 0.05}) sets those that are named; so does
options.rates.opacity = 0.05.)");
  c.def(py::made_by([](py::kwargs const& given) {
     py::object const made = py::cast(train{});
     for (auto const& [key, value] : given) {
       auto const name = py::cast<std::string>(key);
       if (set_field({made, ""}, name, value)) continue;
       if (!has_field(made, name))
         throw py::type_error("no option '" + name + "': there are " + fields_of_class(made) + ", " + field_names(""));
       py::setattr(made, name.c_str(), value);
     }
     return py::cast<train>(made);
   }))
      .def("__getattr__",
           [](py::object const& self, std::string const& name) {
             return get_field({self, ""}, name);
           })
      .def("__setattr__",
           [](py::object const& self, std::string const& name, py::object const& value) {
             if (set_field({self, ""}, name, value)) return;
             if (PyObject_GenericSetAttr(self.ptr(), py::cast(name).ptr(), value.ptr()) != 0) throw py::python_error();
           })
      .def_static(
          "fields",
          [] {
            py::dict out;
            for (gart::option_field const& f : gart::option_fields)
              out[py::cast(f.name)] = py::make_tuple(f.low, f.high, std::string(f.help));
            return out;
          },
          "Name: (least, most, what it is), of all numbers and switches.")
      .def_rw("held_out", &train::held_out, "training views, by index, that are not trained on");
  named_field(c, "densify", &train::densify, "error, mcmc, adc or none: how the number of Gaussians grows");
  named_field(c, "background", &train::background, "white, black or random: what is behind the scene");
  c.def_rw("exposure", &train::exposure, "learn an exposure of each training view");
  c.def_rw("match", &train::match, "start from the points of match_photographs too");
  c.def_rw("vignetting", &train::vignetting, "learn the falloff of each lens");
}

}  // namespace gart_python
