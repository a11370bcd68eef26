// What the library computes: every configuration behind make_renderer and make_session.
#include "scene.hpp"

#include <gart/runtime/renderer.hpp>
#include <gart/runtime/session.hpp>

void use_interface() {
  gart::dataset const data = some_capture();
  for (gart::configuration_info const& configuration : gart::compiled_configurations()) {
    gart::configuration_request request;
    request.backend = configuration.backend, request.tracer = configuration.tracer,
    request.backward = configuration.backward;
    request.sh_degree = configuration.sh_degree;
    std::string const name = std::string("library/") + to_string(configuration.backend) + "/" +
                             to_string(configuration.tracer) + "/" + configuration.backward + "/SH" +
                             std::to_string(configuration.sh_degree) + "/";
    gart::gaussian_model const start = some_model(configuration.sh_degree);

    auto const renderer = gart::make_renderer(request);
    renderer->set_model(start);
    gart::camera const& view = data.train[1].view;
    gart::rendered const seen = renderer->render(view, {});
    tell(name + "image", seen.color.data);
    tell(name + "depth", seen.depth.data);
    renderer->differentiate(view, {}, seen.color);
    tell(name + "gradients", renderer->gradients());

    gart::train_options const options = some_options(configuration.sh_degree);
    auto const training = gart::make_session(request, options, data, &start);
    std::vector<float> losses;
    while (training->steps_done() < options.iterations) losses.push_back(training->step().loss);
    tell(name + "losses", losses);
    tell(name + "model", training->model());
    tell(name + "trained image", training->render(view, gart::vec3(1.0f)).color.data);
  }
}
