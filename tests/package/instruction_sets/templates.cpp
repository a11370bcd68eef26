// What the templates compute where they are instantiated, as the README shows it: every method at SH degree 3,
// and with EVERY_DEGREE at 0, 1 and 2 too.
#include "scene.hpp"

#include <gart/gart.hpp>

namespace {

template <class E, class Tracer, class Method, int Degree>
void train() {
  E exec;
  gart::dataset const data = some_capture();
  gart::train_options const options = some_options(Degree);
  gart::trainer<E, gart::scene_traits<Degree>, Tracer, Method> run(exec, options, data, some_model(Degree));
  std::string const name = std::string("template/") + E::name + "/" + Tracer::name + "/" + Method::name + "/SH" +
                           std::to_string(Degree) + "/";
  gart::camera const& view = data.train[1].view;
  tell(name + "image", run.render(view, gart::vec3(0.0f)).color.data);
  std::vector<float> losses;
  run.step([&](gart::loss_input<E> const& in) {  // a loss of one's own: the mean of the image
    for (std::size_t i = 0; i < in.image.size(); ++i) in.gradient[i] = 1.0f / static_cast<float>(in.image.size());
    in.value[0] = in.value[1] = 1;
  });
  tell(name + "gradients", run.gradients().to_host());
  while (run.steps_done() < options.iterations) losses.push_back(run.step().loss);
  tell(name + "losses", losses);
  tell(name + "model", run.model());
  tell(name + "trained image", run.render(view, gart::vec3(1.0f)).color.data);
}

template <class E, class Tracer, int Degree>
void every_method() {
  gart::gradient_methods::for_each([]<class Method>(Method) {
    if constexpr (!Method::ordered) train<E, Tracer, Method, Degree>();
  });
}

}  // namespace

void use_templates() {
  using tiles = gart::tile_tracer<gart::openmp_exec>;
  every_method<gart::openmp_exec, tiles, 3>();
#if defined(EVERY_DEGREE)
  every_method<gart::openmp_exec, tiles, 0>();
  every_method<gart::openmp_exec, tiles, 1>();
  every_method<gart::openmp_exec, tiles, 2>();
#endif
  every_method<gart::serial_exec, gart::bvh_tracer<gart::serial_exec>, 1>();

  // Functions that are no templates.
  gart::camera view = some_capture().train[0].view;
  std::vector<float> directions;
  for (int k = 0; k < view.width; ++k) {
    gart::vec3 const d = gart::ray_direction(view, 1.3f * static_cast<float>(k), 0.7f * static_cast<float>(k));
    directions.insert(directions.end(), {d.x, d.y, d.z});
  }
  tell("template/ray_direction", directions);
  gart::photo_response response;
  for (int k = 0; k < gart::exposure::floats; ++k) response.exposed.m[k] += 0.013f * static_cast<float>(k);
  for (int k = 0; k < gart::vignetting::floats; ++k) response.falloff.k[k] = -0.02f * static_cast<float>(k + 1);
  response.circle = gart::image_circle(view);
  gart::image_float image(8, 8, 3);
  for (std::size_t k = 0; k < image.data.size(); ++k) image.data[k] = 0.0051f * static_cast<float>(k);
  apply(response, image);
  tell("template/photo_response", image.data);
}
