// A frame and a backward pass called out of order, or with what does not fit: an error that names the call, before
// anything runs.
#include <gart/backward/fallback.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#include <support/policies.hpp>

#include <string>

namespace {

template <class Body>
std::string error_of(Body const& body) {
  try {
    body();
  } catch (gart::invalid_argument const& e) {
    return e.what();
  }
  return "";
}

bool holds(std::string const& text, std::string const& part) { return text.find(part) != std::string::npos; }

gart::gaussian_model one_gaussian() {
  gart::gaussian_model m;
  m.resize(1, 0);
  m.mean[2] = 3, m.quaternion[0] = 1, m.opacity[0] = 1;
  return m;
}

gart::camera small_view() {
  gart::camera c;
  c.width = 9, c.height = 7, c.fx = c.fy = 8, c.cx = 4.5f, c.cy = 3.5f;
  return c;
}

template <class Tracer, class Method, class E>
void check_order(E& exec) {
  using frame_type = gart::frame<E, gart::scene_traits<0>, Tracer>;
  gart::gaussians<E> const scene(exec, one_gaussian());
  gart::camera const view = small_view();
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), gradient(exec, std::vector<float>(3 * pixels, 1.0f));
  gart::buffer<float, E> too_small(exec, pixels), error(exec, std::vector<float>(3, 1.0f));
  gart::gaussians<E> gradients(exec, 1, 0), of_two(exec, 2, 0), of_degree_1(exec, 1, 1);
  frame_type frame(exec), other(exec);
  gart::backward_pass<frame_type, Method> pass(exec);
  auto const differentiate = [&](frame_type& f) {
    return error_of([&] { gart::differentiate(f, pass, gradient, gradients); });
  };
  auto const render = [&] { return error_of([&] { pass.render(frame, {color.data()}); }); };
  auto const prepare = [&] {
    return error_of([&] {
      if (!pass.prepare(frame)) throw pass.out_of_memory_error();
    });
  };

  CHECK(holds(error_of([&] { frame.render({color.data()}); }), "frame.prepare first"));
  CHECK(holds(prepare(), "frame.prepare first"));
  CHECK(holds(render(), "backward_pass.prepare"));
  CHECK(holds(differentiate(frame), "backward_pass.render"));

  frame.prepare(scene.view(), view);
  CHECK(holds(render(), "backward_pass.prepare"));
  CHECK(prepare() == "");
  CHECK(holds(differentiate(frame), "backward_pass.render"));
  CHECK(render() == "");
  CHECK(differentiate(frame) == "");
  CHECK(differentiate(frame) == "");  // as often as wanted

  // Another frame, and another preparation of this one.
  other.prepare(scene.view(), view);
  CHECK(holds(differentiate(other), "backward_pass.render"));
  frame.prepare(scene.view(), view);
  CHECK(holds(differentiate(frame), "backward_pass.render"));
  CHECK(holds(render(), "backward_pass.prepare"));

  // A preparation that fails leaves none.
  gart::camera bad = view;
  bad.fx = 0;
  CHECK(holds(error_of([&] { frame.prepare(scene.view(), bad); }), "focal"));
  CHECK(holds(error_of([&] { frame.render({color.data()}); }), "frame.prepare first"));

  frame.prepare(scene.view(), view);
  CHECK(prepare() == "");
  CHECK(error_of([&] { pass.render(frame, {}); }) == "");
  CHECK(holds(differentiate(frame), "colour"));
  CHECK(render() == "");
  auto const with = [&](auto& image_gradient, auto& to, gart::span<float const> error_of_pixels) {
    return error_of([&] { gart::differentiate(frame, pass, image_gradient, to, error_of_pixels); });
  };
  CHECK(holds(with(too_small, gradients, {}), "three values"));
  CHECK(holds(with(gradient, of_two, {}), "number"));
  CHECK(holds(with(gradient, of_degree_1, {}), "SH degree"));
  CHECK(holds(with(gradient, gradients, error), "a value for each pixel"));
  CHECK(with(gradient, gradients, {}) == "");
}

}  // namespace

TEST_CASE_TEMPLATE("frames and passes out of order say which call is missing", E, GART_TEST_POLICIES) {
  E exec;
  check_order<gart::tile_tracer<E>, gart::primitive_method>(exec);
  check_order<gart::bvh_tracer<E>, gart::pixel_method>(exec);
}

TEST_CASE_TEMPLATE("a frame takes scenes of its SH degree alone", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> const scene(exec, gart::with_sh_degree(one_gaussian(), 1));
  gart::frame<E, gart::scene_traits<0>, gart::bvh_tracer<E>> frame(exec);
  CHECK(holds(error_of([&] { frame.prepare(scene.view(), small_view()); }), "SH degree"));
}
