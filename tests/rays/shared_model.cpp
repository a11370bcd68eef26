// Renderers of several threads over one model and its tree, behind the run-time interface: the bits of renderers that
// have their own, in less memory.
#include <gart/runtime/renderer.hpp>

#include <rays/view_rays.hpp>
#include <support/refused.hpp>

#include <cmath>
#include <thread>

using namespace gart_test;

namespace {

template <class E>
gart::configuration_request request_of(int sh_degree) {
  gart::configuration_request request;
  request.backend = gart::from_string<gart::backend_kind>(E::name);
  request.backward = E::device ? "deterministic" : "primitive";
  request.sh_degree = sh_degree, request.threads = 1;
  return request;
}

// What a thread does with a renderer of its own.
struct sweep_of_a_thread {
  gart::traced_rays seen;
  gart::hit_lists hits;
  gart::rendered view;
  gart::gaussian_model gradients;
  std::size_t bytes = 0;
};

template <class E>
sweep_of_a_thread sweep_by(gart::renderer& renderer, std::uint64_t seed, std::size_t gaussians, int degree) {
  sweep_of_a_thread out;
  random_rays const some(seed, 150, 1.0f);
  gart::ray_batch const on_host{{0.5, 0, 0}, some.origins, some.directions};
  for (int again = 0; again < 3; ++again) out.seen = renderer.trace(on_host, {}, true);
  out.hits = renderer.list_hits(on_host, {});
  E exec;
  batch_memory<E> const batch(exec, on_host.frame, some.origins, some.directions);
  gart::buffer<float, E> const by_color(exec, some.origins);
  gart::gaussians<E> by_gaussians(exec, gaussians, degree);
  exec.synchronize();
  auto const context = renderer.forward(batch.rays(), {}, gart::batch_targets{});
  gart::output_gradients by;
  by.color = by_color;
  context->backward(by, {.gaussians = by_gaussians.view()});
  renderer.wait();
  out.gradients = by_gaussians.to_host();
  out.bytes = renderer.peak_bytes();
  gart::camera view;
  view.width = 33, view.height = 21, view.fx = view.fy = 28, view.cx = 16, view.cy = 10;
  view.position = gart::vec3d(0, 0, -4);
  out.view = renderer.render(view, {});
  return out;
}

bool alike(sweep_of_a_thread const& a, sweep_of_a_thread const& b) {
  return same(a.seen, b.seen) && a.seen.features == b.seen.features && a.hits.ids == b.hits.ids &&
         a.hits.t == b.hits.t && a.view.color.data == b.view.color.data && a.gradients.mean == b.gradients.mean &&
         a.gradients.sh == b.gradients.sh;
}

}  // namespace

TEST_CASE_TEMPLATE("renderers of several threads share one model and its tree", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  for (int const degree : {3, 1}) {
    CAPTURE(degree);
    gart::gaussian_model model = cloud(seed, degree, 800);
    model.feature_count = 2, model.features.assign(2 * model.size(), 0.25f);
    auto const request = request_of<E>(degree);
    constexpr std::size_t threads = 3;
    std::vector<sweep_of_a_thread> got(threads), expected(threads);
    std::size_t bytes_with_a_tree = 0;
    {
      auto handle = gart::make_shared_model(request, model, {}, {0.5, 0, 0});
      CHECK(handle->bytes() > 4 * 17 * model.size());
      std::vector<std::thread> all;
      for (std::size_t k = 0; k < threads; ++k)
        all.emplace_back([&, k, own = handle]() mutable {
          auto const renderer = gart::make_renderer(request);
          renderer->share_model(std::move(own));
          got[k] = sweep_by<E>(*renderer, seed + k, model.size(), degree);
        });
      {
        auto const bound = gart::make_renderer(request);
        bound->bind(handle->gaussians()), bound->bind_channels(handle->channels());
        bytes_with_a_tree = sweep_by<E>(*bound, seed, model.size(), degree).bytes;
      }
      handle.reset();  // the renderers keep it
      for (auto& t : all) t.join();
    }
    for (std::size_t k = 0; k < threads; ++k) {
      auto const renderer = gart::make_renderer(request);
      renderer->set_model(model);
      expected[k] = sweep_by<E>(*renderer, seed + k, model.size(), degree);
      CHECK(alike(got[k], expected[k]));
      CHECK(!got[k].hits.ids.empty());
      // No parameters; and by the same rays no tree, of which the boxes alone are 24 bytes a Gaussian.
      CHECK(got[k].bytes < expected[k].bytes);
      if (k == 0) CHECK(got[k].bytes + 24 * model.size() <= bytes_with_a_tree);
    }
  }
}

TEST_CASE_TEMPLATE("a renderer leaves a shared model for another", E, GART_TEST_POLICIES) {
  gart::gaussian_model const model = cloud(3, 1, 200), other = cloud(4, 1, 150);
  auto const request = request_of<E>(1);
  auto const renderer = gart::make_renderer(request), plain = gart::make_renderer(request);
  auto handle = gart::make_shared_model(request, model);
  std::weak_ptr<gart::shared_model const> const lives = handle;
  renderer->share_model(std::move(handle));
  plain->set_model(model);
  CHECK(alike(sweep_by<E>(*renderer, 5, 200, 1), sweep_by<E>(*plain, 5, 200, 1)));
  CHECK(!lives.expired());
  renderer->set_model(other), plain->set_model(other);
  CHECK(lives.expired());
  CHECK(alike(sweep_by<E>(*renderer, 6, 150, 1), sweep_by<E>(*plain, 6, 150, 1)));
  // Of another alpha_min a tree of one's own.
  gart::render_options coarse;
  coarse.alpha_min = 0.2f;
  renderer->share_model(gart::make_shared_model(request, model)), plain->set_model(model);
  random_rays const some(7, 100, 1.0f);
  gart::ray_batch const rays{{}, some.origins, some.directions};
  CHECK(same(renderer->trace(rays, coarse), plain->trace(rays, coarse)));
}

TEST_CASE_TEMPLATE("a shared model of something else is refused by name", E, GART_TEST_POLICIES) {
  auto const request = request_of<E>(1), higher = request_of<E>(2);
  gart::gaussian_model const model = cloud(3, 1, 50);
  auto const renderer = gart::make_renderer(request);
  refused([&] { renderer->share_model(nullptr); }, "the shared model is null");
  refused([&] { gart::make_shared_model(higher, model); }, "the model is of SH degree 1");
  refused([&] { renderer->share_model(gart::make_shared_model(higher, cloud(3, 2, 50))); },
          "the shared model is of SH degree 2, and the renderer of 1");
  gart::render_options options;
  options.alpha_min = 0;
  refused([&] { gart::make_shared_model(request, model, options); }, "render_options.alpha_min");
  refused([&] { gart::make_shared_model(request, model, {}, {0, std::nan(""), 0}); }, "frame is not finite");

  // A handle that was made for another policy or device.
  struct elsewhere final : gart::shared_model {
    gart::configuration_request of;
    gart::configuration_request const& request() const override { return of; }
    char const* compiled_for() const override { return "another"; }
    gart::gaussians_view<float const> gaussians() const override { return {}; }
    gart::gaussian_channels channels() const override { return {}; }
    std::size_t bytes() const override { return 0; }
  };
  auto const pretend = [&](auto&& change) {
    auto handle = std::make_shared<elsewhere>();
    handle->of = request;
    change(handle->of);
    renderer->share_model(std::move(handle));
  };
  using enum gart::backend_kind;
  refused([&] { pretend([](auto& of) { of.backend = of.backend == serial ? openmp : serial; }); },
          "the shared model is of backend");
  refused([&] { pretend([](auto& of) { of.device = 7; }); }, "of device 7, and the renderer of 0");
  refused([&] { pretend([](auto& of) { of.kernel_degree = 4; }); }, "of kernel degree 4, and the renderer of 2");
  refused([&] { pretend([](auto&) {}); }, "of instruction set another");
}
