// Counts, sizes and settings past what can be had: a clear error before anything is computed, never a wrapped sum.
#include <extremes/scenes.hpp>
#include <support/policies.hpp>

#include <gart/backward/backward.hpp>
#include <gart/exec/serial.hpp>
#include <gart/trace/tile_tracer.hpp>

#include <functional>
#include <limits>

using gart::u32;
using gart::u64;

namespace {

// A Gaussian around the camera: every pixel is in its box.
gart::gaussian_model around_the_camera(int count) {
  gart::gaussian_model m;
  m.resize(static_cast<std::size_t>(count), 0);
  for (auto& x : m.log_scale) x = 5;
  for (std::size_t i = 0; i < m.size(); ++i) m.quaternion[4 * i] = 1;
  return m;
}

// Prepares nothing, where the tracers would build their structures.
template <class E>
struct no_tracer : gart::tracer_base {
  using response_type = gart::generalized_gaussian<>;
  static constexpr char const* name = "none";
  explicit no_tracer(E&) {}
  void prepare(E&, gart::gaussians_view<float const>, gart::span<gart::ray_gaussian const>, gart::camera const&,
               gart::trace_options const&) {}
  gart::pixel_rays rays() const { return {}; }
  gart::origin_rays rays_with_origins() const { return {}; }
  template <gart::ray_program P>
  void trace(E&, char const*, gart::index_t, P const&) {}
};
static_assert(gart::tracer<no_tracer<gart::serial_exec>, gart::serial_exec>);

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

}  // namespace

TEST_CASE_TEMPLATE("sums past 2^32 and pairs past 2^31", E, GART_TEST_POLICIES) {
  E exec;
  {
    gart::buffer<u32, E> const counts(exec, std::vector<u32>(5, 0xffffffffu));
    gart::buffer<u64, E> offsets(exec, 6);
    gart::exclusive_scan(exec, gart::span<u32 const>(counts), offsets.view().subspan(0, 5),
                         offsets.view().subspan(5, 1));
    CHECK(offsets.to_host()[4] == 4 * u64{0xffffffff});
    CHECK(offsets.front() == 0);
    CHECK(offsets.to_host()[5] == 5 * u64{0xffffffff});
  }
  // The largest image there can be: 67 million tiles, 4.3e9 pixels.
  gart::camera view = gart_test::looking_along_z(65535, 65528, 30000);
  gart::gaussian_model const model = around_the_camera(40);
  gart::gaussians<E> const scene(exec, model);
  gart::footprints<E, 8> prints(exec);
  prints.measure(exec, scene.view(), view, 1.0f / 255, 0.01f);
  CHECK(prints.pairs() == u64{40} * 8192 * 8191);
  CHECK(prints.slots() == u64{40} * 65535 * 65528);
  gart::buffer<gart::footprint_slots, E> ranges(exec, 40);
  exec.copy(ranges.data(), prints.ranges().data(), 40 * sizeof(gart::footprint_slots));
  CHECK(u64{ranges.to_host()[39].offset} == u64{39} * 65535 * 65528);

  auto const before = exec.memory.current;
  gart::tile_map<E, 8> map(exec);
  try {
    map.build(exec, {view.width, view.height}, prints, gart::number_order{});
    FAIL("a map of 2.7e9 pairs was built");
  } catch (gart::out_of_memory const& e) {
    CHECK(e.asked == prints.pairs() * 16);
    CHECK(holds(e.what(), std::to_string(prints.pairs())));
    CHECK(holds(e.what(), "train_options.max_gaussians"));
  }
  CHECK(exec.memory.current == before);

  // A budget is held before anything is allocated for it.
  using frame_type = gart::frame<E, gart::scene_traits<0>, no_tracer<E>>;
  frame_type frame(exec);
  frame.prepare(scene.view(), view);
  gart::backward_pass<frame_type, gart::primitive_method> pass(exec);
  CHECK_FALSE(pass.prepare(frame, u64{1} << 40));
  CHECK(pass.hit_buffer_bytes() == 0);
  // Nor are slots that have no number of 32 bits.
  CHECK_FALSE(pass.prepare(frame));
  CHECK(pass.hit_buffer_bytes() == 0);
}

TEST_CASE_TEMPLATE("more bytes than there are, and more than can be counted", E, GART_TEST_POLICIES) {
  E exec;
  for (std::size_t const n : {std::size_t{1} << 56, (std::size_t{1} << 60) + 1, std::size_t{1} << 62}) {
    CAPTURE(n);
    gart::buffer<gart::quad, E> buffer(exec);
    try {
      buffer.resize(n);
      FAIL("was allocated");
    } catch (gart::out_of_memory const& e) {
      CHECK(e.asked >= std::size_t{1} << 60);
    }
    CHECK(buffer.size() == 0);
    CHECK(buffer.capacity() == 0);
    buffer.resize(3);
    CHECK(buffer.size() == 3);
  }
}

TEST_CASE_TEMPLATE("more Gaussians than indices", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> scene(exec, 0, 0);
  CHECK(holds(error_of([&] { scene.resize_keep(gart::most_gaussians + 1); }), "268435456"));
  CHECK(holds(error_of([&] { scene.resize_keep((std::size_t{1} << 32) + 5); }), "train_options.max_gaussians"));
  CHECK(exec.memory.current == 0);
}

TEST_CASE_TEMPLATE("cameras and options that no ray can be traced by are named", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model const model = around_the_camera(2);
  gart::gaussians<E> const scene(exec, model);
  gart::buffer<float, E> color(exec, 3 * 4 * 4);
  auto const render = [&](gart::camera const& view, gart::render_options const& options) {
    return error_of([&] {
      gart::frame<E, gart::scene_traits<0>, gart::tile_tracer<E>> frame(exec);
      frame.prepare(scene.view(), view, options);
      frame.render({color.data()});
    });
  };
  gart::camera const good = gart_test::looking_along_z(4, 4, 4);
  CHECK(render(good, {}) == "");
  float const nan = NAN, infinite = INFINITY;
  auto const camera = [&](auto const& change) {
    gart::camera c = good;
    change(c);
    return render(c, {});
  };
  CHECK(holds(camera([](auto& c) { c.width = 0; }), "image size"));
  CHECK(holds(camera([](auto& c) { c.height = -3; }), "image size"));
  CHECK(holds(camera([](auto& c) { c.width = 65536; }), "65535"));
  CHECK(holds(camera([](auto& c) { c.height = 100000; }), "65535"));
  CHECK(holds(camera([](auto& c) { c.width = c.height = 65535; }), "2^32"));
  for (float const bad : {nan, infinite, 0.0f, -2.0f}) CHECK(holds(camera([&](auto& c) { c.fx = bad; }), "focal"));
  for (float const bad : {nan, infinite, -infinite}) {
    CHECK(holds(camera([&](auto& c) { c.cy = bad; }), "principal point"));
    CHECK(holds(camera([&](auto& c) { c.lens.k2 = bad; }), "distortion"));
    CHECK(holds(camera([&](auto& c) { c.rotation[1][2] = bad; }), "pose"));
    CHECK(holds(camera([&](auto& c) { c.position.z = static_cast<double>(bad); }), "pose"));
  }
  auto const options = [&](auto const& change) {
    gart::render_options o;
    change(o);
    return render(good, o);
  };
  for (float const bad : {nan, infinite, 0.0f, -1.0f}) {
    CHECK(holds(options([&](auto& o) { o.near = bad; }), "near"));
    CHECK(holds(options([&](auto& o) { o.alpha_min = bad; }), "alpha_min"));
  }
  CHECK(holds(options([](auto& o) { o.alpha_min = 1e-35f; }), "alpha_min"));
  for (float const bad : {nan, 1.0f, -1e-9f})
    CHECK(holds(options([&](auto& o) { o.transmittance_min = bad; }), "transmittance_min"));
  for (float const bad : {nan, infinite}) CHECK(holds(options([&](auto& o) { o.background.y = bad; }), "background"));
}
