// What a program of one's own gets from the library is what `gart train` makes: the same bits.

#include "program.hpp"

#include <gart/runtime/choose.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/presets.hpp>
#include <gart/runtime/session.hpp>

#include <support/policies.hpp>

using namespace cli_test;

namespace {

// The whole of such a program.
gart::recommendation train(fs::path const& capture, gart::train_options const& options, fs::path const& model) {
  gart::dataset const data = gart::load_dataset(capture);
  gart::configuration_request request;
  request.backend = gart::backend_kind::serial;
  gart::recommendation const use = gart::recommended(options, data, request);
  auto const training = gart::make_session(use.request, use.options, data);
  while (training->steps_done() < use.options.iterations) training->step();
  gart::save_model(model, {training->model(), gart::render_options_of(use.options, data.extent)});
  return use;
}

}  // namespace

TEST_CASE("a short program over the library and gart train give the same bits") {
  folder const here;
  write_capture(here / "capture");
  gart::train_options options;
  options.iterations = 700;  // past the first densification
  options.max_gaussians = 60;
  train(here / "capture", options, here / "mine.ply");
  auto const run = here.gart("train capture --out run --iterations 700 --max-gaussians 60 --backend serial --quiet");
  REQUIRE_MESSAGE(run.code == 0, run.err);
  CHECK(text_of(here / "mine.ply") == text_of(here / "run/model.ply"));

  // The choices matter to the bits: with another background the model is another.
  auto const white = here.gart(
      "train capture --out white --iterations 700 --max-gaussians 60 --backend serial --background white --quiet");
  REQUIRE_MESSAGE(white.code == 0, white.err);
  CHECK(text_of(here / "mine.ply") != text_of(here / "white/model.ply"));
}

TEST_CASE("the library's presets, exposures and measured bands are those of gart train") {
  folder const here;
  write_capture(here / "capture", 20);
  gart::train_options options;
  options.iterations = gart::measured_from;
  options.max_gaussians = 30;
  gart::preset_named("fast").apply(options.render);
  auto const use = train(here / "capture", options, here / "mine.ply");
  CHECK(use.options.sh_gain == gart::usual_sh_gain);
  auto const run = here.gart("train capture --out run --iterations " + std::to_string(gart::measured_from) +
                             " --max-gaussians 30 --preset fast --backend serial --quiet");
  REQUIRE_MESSAGE(run.code == 0, run.err);
  auto const metrics = here.json("run/metrics.json");
  CHECK_FALSE(metrics["sh_trials"].empty());
  CHECK((metrics["exposure"] == true) == use.options.exposure);
  CHECK(text_of(here / "mine.ply") == text_of(here / "run/model.ply"));
}

template <class Data>
concept trains_on = requires(gart::train_options const& options, Data&& data) {
  gart::make_session({}, options, std::forward<Data>(data));
};

TEST_CASE("what a session would read after it is gone does not compile") {
  static_assert(trains_on<gart::dataset const&> && trains_on<gart::dataset&>);
  static_assert(!trains_on<gart::dataset> && !trains_on<gart::dataset const>);
}

TEST_CASE("names and values of a kind are each other's") {
  CHECK(gart::from_string<gart::densify_kind>("mcmc") == gart::densify_kind::mcmc);
  CHECK(std::string(gart::to_string(gart::tracer_kind::automatic)) == "auto");
  for (auto const& name : gart::list_of_names<gart::lt_format_kind>())
    CHECK(name == gart::to_string(gart::from_string<gart::lt_format_kind>(name)));
  CHECK_THROWS_WITH_AS(gart::from_string<gart::backend_kind>("opencl"),
                       "'opencl' is none of auto, serial, openmp, cuda", gart::invalid_argument);
}

TEST_CASE("what a configuration would ignore is refused") {
  folder const here;
  write_capture(here / "capture");
  gart::dataset const data = gart::load_dataset(here / "capture");
  gart::train_options options;
  options.render.rebuild_every = 4;
  gart::configuration_request request;
  request.backend = gart::backend_kind::openmp, request.tracer = gart::tracer_kind::tiles;
  CHECK_THROWS_WITH_AS(gart::make_session(request, options, data),
                       "render_options.rebuild_every is 4, and the tracer tiles builds no tree: leave it at 1, or use "
                       "configuration_request.tracer = bvh",
                       gart::invalid_argument);
  request.tracer = gart::tracer_kind::bvh;
  CHECK_NOTHROW(gart::make_session(request, options, data));
  request.device = 1;  // of no host policy
  CHECK_THROWS_AS(gart::make_session(request, options, data), gart::unsupported);
}
