// Features learned on Gaussians that stay as they are: gradient descent by what the renderer gives takes the loss down.
#include <gart/runtime/renderer.hpp>

#include <rays/view_rays.hpp>

#include <cmath>

using namespace gart_test;

TEST_CASE_TEMPLATE("features are learned on frozen colours", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  constexpr int width = 16;
  gart::gaussian_model model = cloud(seed, 0, 150);
  std::size_t const numbers = model.size() * width;
  gart::index_t const count = static_cast<gart::index_t>(model.size());
  gart::configuration_request request;
  request.backend = gart::from_string<gart::backend_kind>(E::name), request.sh_degree = 0, request.threads = 1;
  if constexpr (E::device) request.stream = exec.stream();
  auto const renderer = gart::make_renderer(request);
  renderer->set_model(model);

  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  std::vector<float> truth(numbers), learned(numbers, 0.0f);
  for (float& x : truth) x = normal(engine);
  gart::buffer<float, E> features(exec, truth), gradients(exec, numbers);
  gart::camera view = cameras()[0].second;
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> shown(exec, pixels * width), by(exec, pixels * width);
  gart::render_targets to;
  to.channels.features = shown.data();
  renderer->bind_channels({{features.data(), count, width}});
  renderer->render_to(view, {}, to);
  renderer->wait();
  std::vector<float> const wanted = shown.to_host();

  double first = 0, last = 0;
  for (int step = 0; step < 30; ++step) {
    features.assign(learned);
    auto const context = renderer->forward(view, {}, to);
    renderer->wait();
    std::vector<float> off = shown.to_host();
    double loss = 0;
    for (std::size_t i = 0; i < off.size(); ++i) off[i] -= wanted[i], loss += double{off[i]} * double{off[i]};
    (step == 0 ? first : last) = loss;
    by.assign(off);
    gart::output_gradients gradient;
    gradient.channels.features = by, gradient.channels.detached = true;
    gart::gradient_targets out;
    out.channels.features = {gradients.data(), count, width};
    context->backward(gradient, out);
    renderer->wait();
    // A step as long as the weights of a Gaussian's pixels allow.
    std::vector<float> const g = gradients.to_host();
    for (std::size_t i = 0; i < numbers; ++i) learned[i] -= 0.01f * g[i];
  }
  CHECK(first > 0);
  CHECK(last < 0.2 * first);
}
