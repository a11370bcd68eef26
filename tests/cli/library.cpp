// What a program of one's own gets from the library is what `gart train` makes: the same bits.

#include "program.hpp"

#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/session.hpp>

#include <support/policies.hpp>

#include <memory>
#include <set>

using namespace cli_test;
using gart::u8;

namespace {

// The whole of such a program; what it saves after so many steps.
struct own_program {
  gart::dataset data;
  gart::recommendation use;
  std::unique_ptr<gart::session> training;

  own_program(fs::path const& capture, gart::train_options const& options) : data(gart::load_dataset(capture)) {
    gart::configuration_request request;
    request.backend = gart::backend_kind::serial;
    use = gart::recommended(options, data, request);
    training = gart::make_session(use.request, use.options, data);
  }
  std::string model_after(int steps, fs::path const& file) {
    while (training->steps_done() < steps) training->step();
    training->save_model(file, gart::traits_of(gart::render_options_of(use.options, data.extent), 2));
    return text_of(file);
  }
};

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

TEST_CASE("a short program and gart train give the same bits") {
  folder const here;
  gart::train_options options;
  options.iterations = 700;  // past the first densification
  options.max_gaussians = 60;
  auto const same = [&](std::string const& capture) {
    CAPTURE(capture);
    own_program own(here / capture, options);
    auto const run = here.gart("train " + capture + " --out " + capture +
                               "_run --iterations 700 --max-gaussians 60 --backend serial --quiet");
    REQUIRE_MESSAGE(run.code == 0, run.err);
    CHECK(own.model_after(options.iterations, here / "own.ply") == text_of(here / (capture + "_run/model.ply")));
    return own.use.options;
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
  same("even");

  write_capture(here / "uneven");
  fill_images(here / "uneven", true);
  same("uneven");
}

TEST_CASE("the library measures what gart train does, and records it") {
  folder const here;
  write_capture(here / "capture", 24);
  fill_images(here / "capture", true);
  gart::train_options options;
  options.iterations = 15000, options.max_gaussians = 30;
  own_program own(here / "capture", options);
  auto const& trials = own.use.measured.trials;
  REQUIRE_FALSE(trials.empty());
  std::string const run = "train capture --iterations 15000 --max-gaussians 30 --backend serial --out ";
  auto const whole = here.gart(run + "whole");
  REQUIRE_MESSAGE(whole.code == 0, whole.err);
  CHECK_MESSAGE(has(whole.err, "measuring what the capture asks for: "), whole.err);
  auto const metrics = here.json("whole/metrics.json"), measured = metrics["measured"];
  REQUIRE(measured["trials"].size() == trials.size());
  for (std::size_t i = 0; i < trials.size(); ++i) {
    CHECK(measured["trials"][i]["psnr"] == trials[i].psnr);
    CHECK(measured["trials"][i]["taken"] == trials[i].taken);
  }
  CHECK(measured == here.json("whole/config.json")["measured"]);
  CHECK(metrics["wall_seconds"]["measuring"] > 0);
  CHECK(has(text_of(here / "whole/report.html"), "Tried before the run: "));

  // The first steps show what settings a run has, and a resumed one.
  CHECK(here.gart(run + "parts --quiet --stop-at 250").code == 130);
  CHECK(own.model_after(250, here / "mine.ply") == text_of(here / "parts/model.ply"));
  auto const resumed = here.gart("train --resume --out parts --quiet --stop-at 500");
  REQUIRE_MESSAGE(resumed.code == 130, resumed.err);
  CHECK(own.model_after(500, here / "mine.ply") == text_of(here / "parts/model.ply"));
  CHECK(here.json("parts/config.json")["measured"] == measured);
  CHECK(here.json("parts/config.json")["chosen"] == metrics["chosen"]);
}

TEST_CASE("given options are not measured; --no-auto takes the usual") {
  folder const here;
  write_capture(here / "capture", 24);
  std::string const run = "train capture --iterations 21000 --max-gaussians 30 --backend serial --stop-at 1 ";
  auto const tried = [&](std::string const& more) {
    auto const made = here.gart(run + more + " --out run");
    CHECK_MESSAGE(made.code == 130, made.err);
    std::set<std::string> settings;
    auto const config = here.json("run/config.json");
    for (auto const& t : config["measured"]["trials"]) settings.insert(t["setting"]);
    return settings;
  };
  CHECK(tried("--no-auto").empty());
  auto const options = here.json("run/config.json")["options"];
  CHECK(options["exposure"] == "off");
  CHECK(options["vignetting"] == "off");
  CHECK(options["densify"] == "error");
  CHECK(options["set"] == nlohmann::json::object());
  CHECK(tried("").contains("exposure"));
  auto const given = tried("--exposure on --set rates.sh_rest=1e-3");
  CHECK(!given.contains("exposure"));
  CHECK(!given.contains("rates.sh_rest"));
  CHECK(given.contains("vignetting"));
  CHECK(here.json("run/config.json")["options"]["exposure"] == "on");
}

TEST_CASE("a run whose length nobody gives is as long as its trials say") {
  folder const here;
  write_capture(here / "capture", 24);
  fill_images(here / "capture", false);
  std::string const run =
      "train capture --match off --exposure off --vignetting off --set rates.sh_rest=1e-3 --max-gaussians 30 "
      "--backend serial --stop-at 1 --out run ";
  auto const config_of = [&](std::string const& more) {
    auto const made = here.gart(run + more);
    REQUIRE_MESSAGE(made.code == 130, made.err);
    return here.json("run/config.json");
  };
  auto const config = config_of("");
  auto const& trials = config["measured"]["trials"];
  REQUIRE(trials.size() == 2);
  CHECK(trials[1]["setting"] == "iterations");
  CHECK(trials[1]["value"] == "10000");
  CHECK(config["options"]["iterations"] == (trials[1]["taken"] ? 10000 : 30000));
  for (char const* const given : {"--preset quick", "--time-budget 100", "--iterations 30000"}) {
    CAPTURE(given);
    CHECK(config_of(given)["measured"]["trials"].empty());
  }
}

TEST_CASE("photographs are matched where a capture has no points") {
  folder const here;
  write_capture(here / "capture");
  fs::remove(here / "capture/points3d.ply");
  std::string const run = "train capture --out run --iterations 2 --points 50 --backend serial ";
  auto const said = [&](std::string const& more) {
    auto const made = here.gart(run + more);
    REQUIRE_MESSAGE(made.code == 0, made.err);
    return made.out + made.err;
  };
  // They have 16 x 16 pixels, too few to be told apart.
  std::string const by_itself = said("");
  CHECK(has(by_itself, "points matched in the photographs, in "));
  CHECK(has(by_itself, "--match off: "));
  CHECK(has(by_itself, "start 50: the capture has no points: random ones"));
  CHECK(here.json("run/config.json")["options"]["match"] == "off");
  CHECK(here.json("run/metrics.json")["match"] == false);
  CHECK(!has(said("--match off"), "points matched"));
  CHECK(here.gart(run + "--match perhaps").code == 2);
}

TEST_CASE("a run from before the penalty on bands keeps its rates") {
  folder const here;
  write_capture(here / "capture");
  fill_images(here / "capture", true);
  std::string const run = "train capture --iterations 6 --no-auto --backend serial --quiet ";
  for (auto const& [recorded, rate] : {std::pair{"", "0.000125"}, {"rates.sh_rest=0.0005", "0.0005"}}) {
    std::string const set = std::string("--set sh_penalty=0,rates.sh_rest=") + rate;
    REQUIRE(here.gart(run + set + " --out whole").code == 0);
    REQUIRE(here.gart(run + set + " --out parts --stop-at 2").code == 130);
    auto config = here.json("parts/config.json");
    config["options"]["set"] = recorded;
    gart::write_file(here / "parts/config.json", config.dump());
    auto const resumed = here.gart("train --resume --out parts --quiet");
    REQUIRE_MESSAGE(resumed.code == 0, resumed.err);
    CHECK(text_of(here / "parts/model.ply") == text_of(here / "whole/model.ply"));
  }
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
  for (auto const& name : gart::list_of_names<gart::hit_format_kind>())
    CHECK(name == gart::to_string(gart::from_string<gart::hit_format_kind>(name)));
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
