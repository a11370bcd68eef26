// The extension module that gart/__init__.py shows.
#include "bindings.hpp"

#include <gart/core/version.hpp>

GART_PYTHON_MODULE(_gart, m) {
  m.doc() = "gart's compiled part; import gart.";
  m.attr("__version__") = gart::version;
  gart_python::bind_errors(m);
  gart_python::bind_options(m);
  gart_python::bind_scene(m);
  gart_python::bind_dataset(m);
  gart_python::renderer_class renderer = gart_python::bind_renderer(m);
  gart_python::bind_contexts(m, renderer);
  gart_python::bind_session(m);
  gart_python::bind_reference(m);
}
