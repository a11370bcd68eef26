// What a program of one's own gets from the library is what `gart train` makes: the same bits.

#include "program.hpp"

#include <gart/runtime/choose.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/session.hpp>

#include <support/policies.hpp>

using namespace cli_test;
using gart::u8;

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

// Each image of the capture as `paint` leaves it, by its number in its split.
template <class Paint>
void repaint(fs::path const& capture, Paint const& paint) {
  for (char const* split : {"train", "test"}) {
    for (int i = 0; fs::exists(capture / split / ("v" + std::to_string(i) + ".png")); ++i) {
      fs::path const file = capture / split / ("v" + std::to_string(i) + ".png");
      gart::image8 image = gart::read_image(file);
      paint(image, i);
      gart::write_png(file, image);
    }
  }
}

// Something of many colours in place of the background, all images as bright; `uneven`: every other one half as bright.
void fill_images(fs::path const& capture, bool uneven) {
  repaint(capture, [uneven](gart::image8& image, int view) {
    double sum = 0;
    for (std::size_t i = 0; i < image.data.size(); ++i) {
      if (image.data[i] == 20) image.data[i] = static_cast<u8>(60 + 37 * i % 150);
      sum += image.data[i];
    }
    double const mean = uneven && view % 2 ? 50 : 100, gain = mean * static_cast<double>(image.data.size()) / sum;
    for (u8& v : image.data) v = static_cast<u8>(gain * v);
  });
}

}  // namespace

TEST_CASE("a short program over the library and gart train give the same bits") {
  folder const here;
  gart::train_options options;
  options.iterations = 700;  // past the first densification
  options.max_gaussians = 60;
  auto const same = [&](std::string const& capture) {
    CAPTURE(capture);
    gart::recommendation const use = train(here / capture, options, here / (capture + ".ply"));
    auto const run = here.gart("train " + capture + " --out " + capture +
                               "_run --iterations 700 --max-gaussians 60 --backend serial --quiet");
    REQUIRE_MESSAGE(run.code == 0, run.err);
    CHECK(text_of(here / (capture + ".ply")) == text_of(here / (capture + "_run/model.ply")));
    return use.options;
  };
  write_capture(here / "black");
  CHECK(same("black").background == gart::background_kind::black);

  write_capture(here / "white");
  repaint(here / "white", [](gart::image8& image, int) {
    for (u8& v : image.data) v = v == 20 ? 255 : v;
  });
  CHECK(same("white").background == gart::background_kind::white);

  write_capture(here / "even");
  fill_images(here / "even", false);
  CHECK(!same("even").exposure);

  write_capture(here / "uneven");
  fill_images(here / "uneven", true);
  CHECK(same("uneven").exposure);
}

TEST_CASE("what keeps a training from learning by heart is chosen by both, recorded, and gives way to what is given") {
  folder const here;
  write_capture(here / "few");
  fill_images(here / "few", false);
  gart::train_options options;
  options.iterations = 700, options.max_gaussians = 60, options.error.least_budget = 30;
  options.error.pixels_each = 25;  // for 40 Gaussians
  auto const use = train(here / "few", options, here / "mine.ply");
  CHECK(use.options.dropout == 0.2f);
  std::string const set = " --set error.least_budget=30,error.pixels_each=25 --quiet";
  std::string const run = "train few --iterations 700 --max-gaussians 60 --backend serial --out ";
  auto const whole = here.gart(run + "whole --set error.least_budget=30,error.pixels_each=25");
  REQUIRE_MESSAGE(whole.code == 0, whole.err);
  CHECK_MESSAGE(has(whole.err, "  --set dropout 0.2: each of "), whole.err);
  CHECK(has(whole.err, "  --set error.split.share 0.4: their pixels end growth"));
  CHECK(has(whole.err, "  images full size: "));
  CHECK(here.json("whole/config.json")["options"]["set"] == "dropout=0.2,error.least_budget=30,error.pixels_each=25");
  CHECK(text_of(here / "mine.ply") == text_of(here / "whole/model.ply"));

  CHECK(here.gart(run + "parts --stop-at 350" + set).code == 130);
  auto const resumed = here.gart("train --resume --out parts --quiet");
  REQUIRE_MESSAGE(resumed.code == 0, resumed.err);
  CHECK(text_of(here / "parts/model.ply") == text_of(here / "whole/model.ply"));
  CHECK(here.json("parts/metrics.json")["chosen"] == here.json("whole/metrics.json")["chosen"]);

  // A run that began without goes on without, though it gets long enough for it.
  auto const longer = [&](std::string const& out, std::string const& settings) {
    std::string const begun = "train few --iterations 399 --max-gaussians 60 --backend serial --stop-at 1 --out " + out;
    CHECK(here.gart(begun + settings).code == 130);
    CHECK(here.gart("train --resume --iterations 700 --stop-at 20 --quiet --out " + out).code == 130);
    return text_of(here / (out + "/model.ply"));
  };
  CHECK(longer("without", set) ==
        longer("with_none", " --quiet --set dropout=0,error.least_budget=30,error.pixels_each=25"));

  auto const given = here.gart(run + "given --stop-at 1 --set dropout=0,resolution.least=1");
  CHECK(given.code == 130);
  CHECK_MESSAGE(has(given.err, "  --set dropout 0: given\n"), given.err);
  CHECK(has(given.err, "  images a quarter of their width until step 70, half of their width until step 350: "));
  CHECK(here.json("given/config.json")["options"]["set"] == "dropout=0,resolution.least=1");
}

TEST_CASE("where photographs differ in brightness and no exposure is learned, more is chosen against veils") {
  folder const here;
  write_capture(here / "few");
  fill_images(here / "few", true);
  std::string const rules = "error.least_budget=30,error.pixels_each=25",
                    of_run = "--max-gaussians 60 --backend serial ";
  auto const settings = [&](std::string const& out, std::string const& more) {
    auto const run = here.gart("train few --iterations 700 --stop-at 1 " + of_run + more + rules + " --out " + out);
    CHECK(run.code == 130);
    CHECK(has(run.err, "--set dropout_until 0.95: each of ") == (out == "off" || out == "given"));
    return here.json(out + "/config.json")["options"]["set"].get<std::string>();
  };
  std::string const near = "error.split.share=0.25,ssim_weight=0.6,";
  CHECK(settings("off", "--exposure off --set ") == near + "dropout_until=0.95,dropout=0.04," + rules);
  CHECK(settings("given", "--exposure off --set dropout=0.1,") == near + "dropout_until=0.95,dropout=0.1," + rules);
  CHECK(settings("none", "--exposure off --set dropout=0,") == near + "dropout=0," + rules);
  CHECK(settings("learned", "--set ") == "dropout=0.2," + rules);
}

TEST_CASE("the library's exposures and measured bands are those of gart train") {
  folder const here;
  write_capture(here / "capture", 20);
  gart::train_options options;
  options.iterations = gart::measured_from;
  options.max_gaussians = 30;
  auto const use = train(here / "capture", options, here / "mine.ply");
  CHECK(use.options.sh_gain == gart::usual_sh_gain);
  auto const run = here.gart("train capture --out run --iterations " + std::to_string(gart::measured_from) +
                             " --max-gaussians 30 --backend serial --quiet");
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
