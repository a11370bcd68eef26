// A capture with a mirror in it, trained with the mirror known and without: by a trainer.
#include <gart/light/mirror_paths.hpp>

#include <light/small_scenes.hpp>
#include <train/runs.hpp>

using namespace gart_test;

namespace {

gart::camera towards_mirror(float angle) {
  gart::camera view = camera_at({}, 30, 22, 26);
  float const c = std::cos(angle), s = std::sin(angle);
  view.rotation = gart::mat3(vec3(c, 0, -s), vec3(0, 1, 0), vec3(s, 0, c));
  view.position = vec3d(-3.0 * double{s}, 0, -3.0 * double{c});
  return view;
}

}  // namespace

TEST_CASE_TEMPLATE("a capture with a known mirror is learned better", E, GART_TEST_POLICIES) {
  E exec;
  light::scene scene;
  // A ball: no Gaussians within it look like its reflections from two sides.
  scene.meshes = {ball({0, 0, 0}, 0.7f, 0, 24, true)};
  scene.materials = {material_of(light::material_kind::mirror, vec3(0.9f))};
  gart::gaussian_model const truth = cloud(3, 1.0f);
  gart::gaussians<E> const there(exec, truth);
  auto const photograph = [&](gart::camera const& view) {
    gart::mirror_paths<E> paths(exec);
    paths.set_scene(scene), paths.set_model(there.view(), 1);
    gart::buffer<float, E> color(exec, std::size_t{3} * 30 * 22);
    paths.forward(view, {}, 2, color.data());
    return color.to_host();
  };
  gart::dataset data;
  for (int v = 0; v < 8; ++v) {
    gart::dataset_view view;
    view.name = std::to_string(v);
    view.view = towards_mirror(0.3f * static_cast<float>(v - 4));
    view.image = gart::image8(30, 22, 3);
    auto const color = photograph(view.view);
    for (std::size_t i = 0; i < color.size(); ++i)
      view.image.data[i] = static_cast<gart::u8>(std::lround(255 * std::clamp(color[i], 0.0f, 1.0f)));
    data.train.push_back(std::move(view));
  }
  gart::train_options options;
  options.iterations = 1000, options.densify = gart::densify_kind::none, options.sh_every = 1;
  options.max_gaussians = 400;

  auto const psnr_of = [&](bool known) {
    data.mirrors = known ? scene : light::scene{};
    run_of<E> run(exec, options, data, cloud(4, 1.0f));
    for (int i = 0; i < options.iterations; ++i) run.step();
    double square = 0;
    long count = 0;
    for (int v = 0; v < 7; ++v) {  // between those that were trained on
      gart::camera const view = towards_mirror(0.3f * (static_cast<float>(v - 4) + 0.5f));
      std::vector<float> const expected = photograph(view);
      gart::image_float const shown = run.render(view, vec3(0.0f)).color;
      for (std::size_t i = 0; i < expected.size(); ++i, ++count)
        square += std::pow(double{shown.data[i]} - double{expected[i]}, 2);
    }
    return -10 * std::log10(square / static_cast<double>(count));
  };
  double const without = psnr_of(false), with = psnr_of(true);
  CAPTURE(without);
  CAPTURE(with);
  CHECK(with > without + 1);

  data.mirrors = scene;
  data.mirrors.materials[0].kind = light::material_kind::surface;
  CHECK_THROWS_WITH_AS(run_of<E>(exec, options, data, cloud(4, 0.5f)), doctest::Contains("no material of the scene"),
                       gart::invalid_argument);
}
