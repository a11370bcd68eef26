#include <gart/core/error.hpp>
#include <gart/runtime/degree_selection.hpp>
#include <gart/runtime/initial.hpp>
#include <gart/runtime/registry.hpp>

namespace gart {

std::unique_ptr<renderer> make_renderer(configuration_request const& request) {
  return find_configuration(request).make_renderer(request);
}

std::unique_ptr<session> make_session(configuration_request const& wanted, train_options const& options,
                                      dataset const& data, gaussian_model const* start) {
  configuration_request request = wanted;
  request.depth = wanted.depth || options.depth_weight > 0;
  compiled_configuration const& found = find_configuration(request);
  require_tree(options.render.rebuild_every, found.info.tracer);
  trial_plan const plan = plan_trials(request, options, data.train.size());
  gaussian_model const from = start ? *start : initial_model(data, options, request.sh_degree);
  if (!plan.held_out.empty()) return make_degree_selection(request, options, data, from, plan);
  return found.make_session(request, options, data, from);
}

}  // namespace gart
