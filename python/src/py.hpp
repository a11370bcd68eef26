#pragma once
// Python's objects, by nanobind where GART_NANOBIND is defined, else by pybind11. Sources say `py::` and nanobind's
// words, and are written once. Here stands what the two have apart; whatever else they use means the same in both.
//
// class_            of this module alone; objects may be referred to weakly
// made_by(f)        a constructor: what f returns
// others("name")    the place of py::kwargs among an argument list's names
// numpy_array       memory that `owner` keeps
// translate_errors  by a lambda that takes a std::exception_ptr and holds nothing

#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#ifdef GART_NANOBIND

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <functional>

namespace gart_python::py {

using namespace nanobind;
using others = arg;

// Any smart pointer may hold an object of nanobind's: Holder says which does in pybind11.
template <class T, class Holder = void>
struct class_ : nanobind::class_<T> {
  class_(handle scope, char const* name, char const* doc)
      : nanobind::class_<T>(scope, name, doc, is_weak_referenceable()) {}
};

template <class F>
struct made_by : def_visitor<made_by<F>> {
  explicit made_by(F given) : f(given) {}
  template <class C, class... Extra>
  void execute(C& c, Extra const&... extra) const {
    define(c, decltype(std::function(f))(), extra...);
  }

 private:
  template <class C, class T, class... Args, class... Extra>
  void define(C& c, std::function<T(Args...)> const&, Extra const&... extra) const {
    c.def(
        "__init__", [f = f](T* self, Args... args) { new (self) T(f(std::forward<Args>(args)...)); }, extra...);
  }
  F f;
};

inline object imported(char const* name) { return module_::import_(name); }
inline auto type_error(std::string const& text) { return nanobind::type_error(text.c_str()); }
inline auto attribute_error(std::string const& text) { return nanobind::attribute_error(text.c_str()); }

template <class T>
object numpy_array(std::vector<std::int64_t> const& shape, T* data, handle owner) {
  std::vector<std::size_t> const lengths(shape.begin(), shape.end());
  return nanobind::cast(ndarray<numpy, T>(data, lengths.size(), lengths.data(), owner));
}

template <class F>
void translate_errors(F) {
  register_exception_translator([](std::exception_ptr const& thrown, void*) { F{}(thrown); });
}

// Modules of one domain share types and translators of errors. nanobind names it where it compiles, which two copies of
// this module would share: each that is loaded has its own.
static inline std::string domain() {
  static char const here = 0;
  return "gart" + std::to_string(reinterpret_cast<std::uintptr_t>(&here));
}

}  // namespace gart_python::py

#undef NB_DOMAIN_STR
#define NB_DOMAIN_STR gart_python::py::domain().c_str()
// Objects that are alive where the process ends are no news to its user.
#define GART_PYTHON_MODULE(name, m)             \
  static void bind_##name(nanobind::module_ m); \
  NB_MODULE(name, all) {                        \
    nanobind::set_leak_warnings(false);         \
    bind_##name(all);                           \
  }                                             \
  static void bind_##name(nanobind::module_ m)

#else

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace gart_python::py {

using namespace pybind11;
using python_error = error_already_set;

// pybind11 counts py::kwargs by itself.
struct others {
  explicit others(char const*) {}
};

template <class T, class Holder = std::unique_ptr<T>>
struct class_ {
  class_(handle scope, char const* name, char const* doc) : it(scope, name, module_local(), doc) {}
#define GART_CLASS_MEMBER(name, of_pybind11)       \
  template <class... Given>                        \
  class_& name(Given&&... given) {                 \
    it.of_pybind11(std::forward<Given>(given)...); \
    return *this;                                  \
  }
  GART_CLASS_MEMBER(def, def)
  GART_CLASS_MEMBER(def_static, def_static)
  GART_CLASS_MEMBER(def_ro, def_readonly)
  GART_CLASS_MEMBER(def_rw, def_readwrite)
  GART_CLASS_MEMBER(def_prop_ro, def_property_readonly)
  GART_CLASS_MEMBER(def_prop_rw, def_property)
#undef GART_CLASS_MEMBER

  pybind11::class_<T, Holder> it;
};

template <class F>
auto made_by(F f) {
  return init(std::move(f));
}

inline object borrow(handle h) { return reinterpret_borrow<object>(h); }
inline object imported(char const* name) { return module_::import(name); }

template <class T>
object numpy_array(std::vector<std::int64_t> const& shape, T* data, handle owner) {
  return array_t<T>(shape, data, owner);
}

template <class F>
void translate_errors(F f) {
  register_local_exception_translator(f);
}

}  // namespace gart_python::py

template <>
struct pybind11::detail::process_attribute<gart_python::py::others>
    : process_attribute_default<gart_python::py::others> {};

#define GART_PYTHON_MODULE PYBIND11_MODULE

#endif
