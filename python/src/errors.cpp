// gart's errors as Python's, which gart/errors.py declares.
#include "bindings.hpp"

#include <gart/core/error.hpp>

namespace gart_python {

namespace {

// Of this module: another gart may be in the process. Kept to the end.
PyObject* errors = nullptr;

template <class... Attributes>
void raise(char const* type, std::string const& message, Attributes const&... attributes) {
  py::object const kind = py::handle(errors).attr(type), error = kind(message);
  (py::setattr(error, attributes.first, py::cast(attributes.second)), ...);
  PyErr_SetObject(kind.ptr(), error.ptr());
}

}  // namespace

void bind_errors(py::module_& m) {
  // Of the package that this module lies in, whose name need not be gart.
  auto const name = py::cast<std::string>(m.attr("__name__"));
  errors = py::imported((name.substr(0, name.rfind('.')) + ".errors").c_str()).release().ptr();
  py::translate_errors([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (gart::io_error const& e) {
      raise("IoError", e.what(), std::pair("place", e.place), std::pair("remedy", e.remedy));
    } catch (gart::unsupported const& e) {
      raise("Unsupported", e.what());
    } catch (gart::invalid_argument const& e) {
      raise("InvalidArgument", e.what());
    } catch (gart::out_of_memory const& e) {
      raise("OutOfMemory", e.what(), std::pair("asked", e.asked), std::pair("available", e.available));
    } catch (gart::not_finite const& e) {
      raise("NotFinite", e.what(), std::pair("group", e.group), std::pair("gaussian", e.gaussian));
    } catch (gart::error const& e) {
      raise("Error", e.what());
    }
  });
}

}  // namespace gart_python
