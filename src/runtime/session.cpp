#include <gart/runtime/initial.hpp>
#include <gart/runtime/registry.hpp>

namespace gart {

namespace {

configuration_request with_depth_of(configuration_request request, train_options const& options) {
  request.depth = request.depth || options.depth_weight > 0;
  return request;
}

}  // namespace

std::unique_ptr<renderer> make_renderer(configuration_request const& request) {
  return find_configuration(request).make_renderer(request);
}

std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const& data, gaussian_model const* start) {
  if (start) return make_session(request, options, data, start_model(*start));
  resolve(with_depth_of(request, options));  // missing parts are known before anything is made
  return make_session(request, options, data, start_model(initial_model(data, options, request.sh_degree)));
}

std::unique_ptr<session> make_session(configuration_request const& wanted, train_options const& options,
                                      dataset const& data, start_model const& start) {
  configuration_request const request = with_depth_of(wanted, options);
  compiled_configuration const& found = find_configuration(request);
  require_tree(options.render.rebuild_every, found.info.tracer);
  return found.make_session(request, options, data, start);
}

}  // namespace gart
