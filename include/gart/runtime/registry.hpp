#pragma once
/// \file
/// The table of compiled configurations behind make_session and make_renderer. Libraries register theirs when they are
/// loaded (GART_REGISTER_CONFIGURATIONS); programs may add their own (examples/5_own_configuration).

#include <gart/core/error.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/runtime/session.hpp>

#include <memory>
#include <string>

namespace gart {

/// One entry of the table of configurations.
struct compiled_configuration {
  configuration_info info;  ///< what it is
  int rank = 0;  ///< "auto" takes the highest that is available; configurations that trade something lie below 0
  /// False: no device, with the reason.
  bool (*available)(std::string* reason);
  std::unique_ptr<renderer> (*make_renderer)(configuration_request const&);  ///< a renderer of this configuration
  /// A session of this configuration.
  std::unique_ptr<session> (*make_session)(configuration_request const&, train_options const&, dataset const&,
                                           start_model const& start);
};

/// Adds an entry to the table; before main, from static initialisers.
void register_configuration(compiled_configuration const& entry);
/// The highest ranked entry that meets a request. Errors: unsupported, naming the compiled configurations.
compiled_configuration const& find_configuration(configuration_request const& request);

/// Only the tracers bvh and optix have a tree to refit.
inline void require_tree(int rebuild_every, tracer_kind tracer) {
  bool const has_tree = tracer == tracer_kind::bvh || tracer == tracer_kind::optix || tracer == tracer_kind::own;
  if (rebuild_every != 1 && !has_tree)
    throw invalid_argument(std::string("render_options.rebuild_every is ") + std::to_string(rebuild_every) +
                           ", and the tracer " + to_string(tracer) +
                           " builds no tree: leave it at 1, or use configuration_request.tracer = bvh");
}

/// A renderer takes a shared model that was made for what it is itself.
void require_shared(shared_model const* model, configuration_info const& own, int device);

/// For policies that every machine has.
inline bool always_available(std::string*) { return true; }

}  // namespace gart

/// Runs the rest of its arguments before main. `name` becomes a symbol that keeps the linker from dropping the object.
#define GART_REGISTER_CONFIGURATIONS(name, ...) \
  extern "C" bool name;                         \
  bool name = [] {                              \
    __VA_ARGS__;                                \
    return true;                                \
  }();
