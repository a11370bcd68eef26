// What needs no device: memory that ends at any allocation, starting points in one place, what is stored in which type.
#include <extremes/scenes.hpp>
#include <extremes/way.hpp>

#include <gart/runtime/initial.hpp>

#include <chrono>
#include <cmath>
#include <memory>

namespace {

// The serial policy with so many bytes and no more.
class limited_exec : public gart::serial_exec {
 public:
  std::size_t most = 0;
  void* allocate(std::size_t bytes) {
    std::size_t const used = static_cast<std::size_t>(memory.current);
    if (used + bytes > most)
      throw gart::out_of_memory("limited", bytes, most - used, "lower train_options.max_gaussians");
    return gart::serial_exec::allocate(bytes);
  }
};
static_assert(gart::host_execution<limited_exec>);

}  // namespace

TEST_CASE("memory may end at any allocation; the next try succeeds") {
  gart_test::number_source random(7);
  gart::gaussian_model const model = gart_test::cloud(random, 30);
  gart::camera const view = gart_test::looking_along_z(17, 13, 16);
  std::vector<float> const gradient(std::size_t{3} * view.width * view.height, 0.5f);
  using tracer = gart::tile_tracer<limited_exec>;
  limited_exec exec;
  auto const run = [&] { return gart_test::run_by<gart::primitive_method, tracer>(exec, model, view, {}, gradient); };
  exec.most = std::size_t{1} << 30;
  auto const expected = run();
  std::size_t const needed = static_cast<std::size_t>(exec.memory.peak);
  std::size_t const kept = static_cast<std::size_t>(exec.memory.current);  // the workspace of the sort
  int refused = 0;
  for (std::size_t most = kept; most < needed; most += needed / 97 + 1) {
    exec.most = most;
    CHECK_THROWS_AS(run(), gart::out_of_memory);
    CHECK(static_cast<std::size_t>(exec.memory.current) == kept);
    ++refused;
  }
  CHECK(refused > 50);
  exec.most = needed;
  auto const got = run();
  CHECK(got.color == expected.color);
  CHECK(got.gradients.mean == expected.gradients.mean);
}

TEST_CASE("starting points in one place give finite Gaussians, in time") {
  gart::point_cloud points;
  for (int i = 0; i < 100000; ++i) {
    float const at = i % 2 ? 1.0f : 1e7f;
    points.position.insert(points.position.end(), {at, -at, at});
    points.color.insert(points.color.end(), {10, 20, 30});
  }
  auto const start = std::chrono::steady_clock::now();
  gart::gaussian_model const m = gart::model_from_points(points, 3, 0.1f, 1.0f);
  std::chrono::duration<double> const elapsed = std::chrono::steady_clock::now() - start;
  CHECK(elapsed.count() < 30);  // a search that goes on through equals takes minutes
  REQUIRE(m.size() == 100000);
  for (float const s : m.log_scale) REQUIRE(s == doctest::Approx(0.5 * std::log(1e-7)));
}

TEST_CASE("black points start where their colour has a gradient") {
  gart::point_cloud points;
  points.position = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  points.color = {0, 0, 0, 0, 255, 1, 0, 0, 0, 7, 0, 9};
  gart::gaussian_model const m = gart::model_from_points(points, 0, 0.1f, 1.0f);
  for (std::size_t i = 0; i < m.sh.size(); ++i) {
    double const shown = 0.5 + 0.28209479177387814 * static_cast<double>(m.sh[i]);
    CHECK(shown > 1e-3);
    CHECK(shown == doctest::Approx(points.color[i] / 255.0).epsilon(0.0021));
  }
}

TEST_CASE("only places of boxes take less than 32 bits") {
  using namespace gart;
  static_assert(std::is_same_v<decltype(gaussian_model::mean)::value_type, float>);
  static_assert(std::is_same_v<decltype(gaussians<serial_exec>::log_scale), buffer<float, serial_exec>>);
  static_assert(std::is_same_v<decltype(ray_gaussian::row::o), float> && sizeof(ray_gaussian) == 64);
  static_assert(std::is_same_v<decltype(hit::t), float> && std::is_same_v<decltype(hit::alpha), float>);
  static_assert(std::is_same_v<decltype(hit_entry::w), float> && sizeof(hit_entry) == 16);
  static_assert(std::is_same_v<decltype(weight_entry::w), float> && sizeof(weight_entry) == 4);
  static_assert(std::is_same_v<decltype(moments_of<float>::v), float[moment_stride]>);
  static_assert(std::is_same_v<decltype(box::lo), vec3>);            // of which a bvh_node holds what lies around it
  static_assert(std::is_same_v<decltype(camera::position), vec3d>);  // what everything is relative to
  CHECK(true);
}
