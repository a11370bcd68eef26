// The methods' gradients of a benchmark scene, synth_100k.ply with synth_100k.json in the folder that GART_SCENES
// names: at full size on a device, at a quarter of it on hosts.
#include <render/expected.hpp>

#include <gart/io/dataset.hpp>
#include <gart/io/ply.hpp>

#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>

using namespace gart_test;

TEST_CASE_TEMPLATE("all methods give the same gradients on a benchmark scene", E, GART_TEST_POLICIES) {
  char const* const folder = std::getenv("GART_SCENES");
  std::filesystem::path const stem = std::filesystem::path(folder ? folder : ".") / "synth_100k";
  if (!folder || !std::filesystem::exists(stem.string() + ".ply")) {
    MESSAGE("skipped: GART_SCENES names no folder with synth_100k.ply");
    return;
  }
  E exec;
  gart::gaussian_model const model = gart::read_splat_ply(stem.string() + ".ply");
  REQUIRE(model.sh_degree == 3);
  gart::camera view = gart::load_cameras(stem.string() + ".json").front().view;
  if (!E::device) view = gart::resized(view, view.width / 4, view.height / 4);
  std::mt19937_64 engine(seed());
  std::uniform_real_distribution<float> uniform(-1e-6f, 1e-6f);
  std::vector<float> color_gradient(3 * static_cast<std::size_t>(view.width) * view.height);
  for (float& g : color_gradient) g = uniform(engine);

  auto const by = [&](tracer_kind kind, std::string const& method) {
    return scene_gradients(exec, model, view, {}, 3, kind, method, color_gradient);
  };
  gart::gaussian_model const expected = by(tracer_kind::tiles, "deterministic");
  auto const to_double = [](std::vector<float> const& v) { return std::vector<double>(v.begin(), v.end()); };
  for (auto const kind : tracers<E>())
    for (std::string const& method : methods_for(kind, 3)) {
      CAPTURE(static_cast<int>(kind));
      CAPTURE(method);
      gart::gaussian_model const got = by(kind, method);
      for (auto const& g : gradient_groups) {
        CAPTURE(g.name);
        CHECK(relative_error(got.*g.got, to_double(expected.*g.got)) <= 1e-5);
      }
    }
}
