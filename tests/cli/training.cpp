// Whole runs on a capture so small that they take a second.

#include "program.hpp"

#include <support/policies.hpp>

using namespace cli_test;

namespace {

std::string const small = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet ";

}  // namespace

TEST_CASE("train leaves every file it promises, and they agree") {
  folder const here;
  write_capture(here / "capture");
  auto const run =
      here.gart("train capture --out run --iterations 30 --eval-every 10 --backend serial --max-gaussians 60");
  REQUIRE_MESSAGE(run.code == 0, run.err);
  CHECK(has(run.out, "test PSNR "));
  CHECK(has(run.out, "run/report.html"));
  CHECK(has(run.err, "30/30"));
  CHECK_FALSE(has(run.err, "\r"));  // plain lines where there is no terminal

  auto const metrics = here.json("run/metrics.json");
  for (char const* key : {"psnr", "ssim", "views", "split", "background", "resize_filter", "test_views", "iterations",
                          "gaussians", "seconds", "backend", "tracer", "backward", "stages_ms", "peak_bytes",
                          "iterations_per_second", "approximations"}) {
    CAPTURE(key);
    CHECK(metrics.contains(key));
  }
  CHECK(metrics["backend"] == "serial");
  CHECK(metrics["background"] == "black");
  CHECK(metrics["iterations"] == 30);
  CHECK(metrics["approximations"]["alpha_min"].get<double>() == doctest::Approx(1.0 / 255));
  REQUIRE(metrics["views"].size() == 2);
  CHECK(metrics["psnr"].get<double>() ==
        doctest::Approx((metrics["views"][0]["psnr"].get<double>() + metrics["views"][1]["psnr"].get<double>()) / 2));
  CHECK(metrics["stages_ms"].size() > 3);

  for (auto const& view : metrics["views"]) {
    auto const name = view["name"].get<std::string>();
    auto const truth = gart::read_image(here / ("run/renders/" + name + "_truth.png"));
    auto const render = gart::read_image(here / ("run/renders/" + name + ".png"));
    CHECK(truth.width == 16);
    CHECK(render.data.size() == truth.data.size());
    // From the files alone, 8 bits each: within what rounding does to the score.
    double sum = 0;
    for (std::size_t i = 0; i < truth.data.size(); ++i) sum += std::pow((render.data[i] - truth.data[i]) / 255.0, 2);
    CHECK(-10 * std::log10(sum / static_cast<double>(truth.data.size())) ==
          doctest::Approx(view["psnr"].get<double>()).epsilon(0.005));
  }
  CHECK(gart::read_splat_ply(here / "run/model.ply").size() == metrics["gaussians"].get<std::size_t>());
  auto const course = here.json("run/history.json");
  CHECK(course["train"].back()[0] == 30);
  CHECK(course["test"].size() == 3);

  auto const page = text_of(here / "run/report.html");
  char psnr[16];
  std::snprintf(psnr, sizeof psnr, "%.2f", metrics["psnr"].get<double>());
  CHECK(has(page, psnr));
  CHECK(has(page, "<polyline"));
  CHECK(has(page, "data:image/jpeg;base64,/9j/"));
  auto const heading = [&](std::size_t view) {
    return page.find("<b>" + metrics["views"][view]["name"].get<std::string>() + "</b>");
  };
  bool const second_is_worse = metrics["views"][1]["psnr"] < metrics["views"][0]["psnr"];
  REQUIRE(heading(0) != page.npos);
  REQUIRE(heading(1) != page.npos);
  CHECK((heading(1) < heading(0)) == second_is_worse);  // the worst comes first
  CHECK(has(page, "<div class=\"slide\">"));
  CHECK_FALSE(has(page, "http"));  // one page, without a network
  CHECK_FALSE(has(page, "src=\"renders"));
}

TEST_CASE("a run that was stopped and resumed ends with the same bytes") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out whole --iterations 20" + small).code == 0);
  auto const stopped = here.gart("train capture --out parts --iterations 20 --stop-at 10" + small);
  CHECK(stopped.code == 130);
  CHECK(fs::exists(here / "parts/model.ply"));
  CHECK_FALSE(fs::exists(here / "parts/metrics.json"));
  CHECK(text_of(here / "parts/model.ply") != text_of(here / "whole/model.ply"));
  auto const resumed = here.gart("train --resume --out parts");
  REQUIRE_MESSAGE(resumed.code == 0, resumed.err);
  // Starting over would end with the same bytes too.
  CHECK_MESSAGE(has(resumed.err, "resuming after step 10\n"), resumed.err);
  CHECK(has(resumed.err, "\n11/20 "));
  CHECK(text_of(here / "parts/model.ply") == text_of(here / "whole/model.ply"));
  CHECK(here.json("parts/metrics.json")["psnr"] == here.json("whole/metrics.json")["psnr"]);
  CHECK(here.json("parts/history.json")["train"].size() == here.json("whole/history.json")["train"].size());
}

TEST_CASE("choices are said with reasons; given options are kept") {
  folder const here;
  write_capture(here / "capture", 20, 2);
  std::string const run = "train capture --iterations 60 --backend serial --max-gaussians 40 --densify none --out ";
  auto const whole = here.gart(run + "whole");
  REQUIRE_MESSAGE(whole.code == 0, whole.err);
  CHECK_MESSAGE(has(whole.err, "  --background black: the images' borders are plain black (20 20 20)\n"), whole.err);
  CHECK(has(whole.err, ": the lenses are pinholes\n"));
  CHECK(has(whole.err, "  measured nothing: "));
  auto const metrics = here.json("whole/metrics.json");
  CHECK(metrics["sh_degree"] == 3);
  CHECK(metrics["chosen"] == here.json("whole/config.json")["chosen"]);
  CHECK(has(text_of(here / "whole/report.html"), "Chosen for this capture"));
  auto const changed = here.gart("train --resume --no-auto --out whole");
  CHECK(changed.code == 2);
  CHECK_MESSAGE(has(changed.err, "--auto false: the run to be resumed has true"), changed.err);
  auto const white = here.gart("train capture --out run --iterations 3 --background white --quiet");
  REQUIRE(white.code == 0);
  CHECK(here.json("run/metrics.json")["background"] == "white");
}

TEST_CASE("signals end a run after a step, saved") {
  folder const here;
  write_capture(here / "capture");
  int signal = 0;
  SUBCASE("SIGINT") { signal = SIGINT; }
  SUBCASE("SIGTERM") { signal = SIGTERM; }
  SUBCASE("SIGHUP") { signal = SIGHUP; }
  auto const run = here.gart_interrupted_at(
      " it/s", "train capture --out run --iterations 100000000 --backend serial --max-gaussians 60 --densify none",
      signal);
  CHECK(run.code == 130);
  CHECK(has(run.err, "gart train --resume --out run"));
  CHECK(gart::read_splat_ply(here / "run/model.ply").size() == 40);
  int const step = here.json("run/history.json")["train"].back()[0];
  CHECK(has(run.err, "Stopped after step"));
  CHECK(step > 0);
}

TEST_CASE("resuming refuses contradictions and a missing run") {
  folder const here;
  write_capture(here / "capture");
  write_capture(here / "other", 5);
  REQUIRE(here.gart("train capture --out run --iterations 20 --stop-at 5" + small).code == 130);
  auto const before = text_of(here / "run/checkpoint.gart");
  auto const shorter = here.gart("train --resume --out run --iterations 10");
  CHECK(shorter.code == 2);
  CHECK_MESSAGE(has(shorter.err, "--iterations 10: the run to be resumed has 20"), shorter.err);
  CHECK(has(shorter.err, "can only be raised"));
  CHECK(here.gart("train --resume --out run --seed 2").code == 2);
  auto const same = here.gart("train other --resume --out run");
  CHECK(same.code == 2);
  CHECK_MESSAGE(has(same.err, "has 5 train_views"), same.err);
  CHECK(text_of(here / "run/checkpoint.gart") == before);
  auto const absent = here.gart("train capture --resume --out nowhere");
  CHECK(absent.code == 1);
  CHECK(has(absent.err, "nowhere/config.json"));
  CHECK_FALSE(fs::exists(here / "nowhere"));
  CHECK(here.gart("train --resume --out run --iterations 20 --quiet").code == 0);
}

TEST_CASE("train, eval and render agree on a model") {
  folder const here;
  write_capture(here / "capture");
  auto const trained = here.gart(
      "train capture --out run --iterations 20 --alpha-min 0.01 --max-hits 4 --tracer bvh --adam seen" + small);
  REQUIRE(trained.code == 0);
  CHECK(has(text_of(here / "run/model.ply"), "comment gart alpha_min 0.00999999978\n"));
  CHECK(has(text_of(here / "run/model.ply"), "comment gart max_hits 4\n"));
  CHECK(here.json("run/metrics.json")["approximations"]["max_hits"] == 4);
  CHECK(here.json("run/metrics.json")["approximations"]["adam"] == "seen");
  CHECK(has(text_of(here / "run/report.html"), "only the Gaussians that its view showed"));
  auto const eval =
      here.gart("eval run/model.ply capture --out scores.json --renders views --backend serial --tracer bvh");
  REQUIRE_MESSAGE(eval.code == 0, eval.err);
  // In variables: C++20 destroys what json() returns before a loop over a part of it begins.
  auto const scores = here.json("scores.json"), metrics = here.json("run/metrics.json");
  CHECK(scores["psnr"].get<double>() == doctest::Approx(metrics["psnr"].get<double>()).epsilon(1e-6));
  for (auto const& [name, value] : scores["approximations"].items()) CHECK(metrics["approximations"][name] == value);

  auto const render =
      here.gart("render run/model.ply capture --out images --depth --json timings.json --backend serial --tracer bvh");
  REQUIRE_MESSAGE(render.code == 0, render.err);
  CHECK(here.json("timings.json")["views"].size() == 6);
  for (auto const& view : scores["views"]) {
    auto const name = view["name"].get<std::string>() + ".png";
    CHECK(text_of(here / ("images/" + name)) == text_of(here / ("run/renders/" + name)));
    CHECK(text_of(here / ("views/" + name)) == text_of(here / ("run/renders/" + name)));
  }
  auto const half = here.gart("render run/model.ply capture --out half --downscale 2 --quiet");
  REQUIRE(half.code == 0);
  CHECK(half.out.empty());
  CHECK(half.err.empty());
  for (auto const& file : fs::directory_iterator(here / "half")) CHECK(gart::read_image(file.path()).width == 8);
  // A factor that divides no side: the cameras are those of the capture's photographs, shrunk by it.
  REQUIRE(here.gart("eval run/model.ply capture --out third.json --renders third_scored --downscale 3").code == 0);
  REQUIRE(here.gart("render run/model.ply capture --out third --downscale 3").code == 0);
  for (auto const& view : scores["views"]) {
    auto const name = view["name"].get<std::string>() + ".png";
    CHECK(text_of(here / ("third/" + name)) == text_of(here / ("third_scored/" + name)));
  }
  CHECK(has(here.gart("render run/model.ply capture --out none --downscale 32").err, "leaves nothing of the camera"));
}

TEST_CASE("a model's header keeps the near distance; --start reads it") {
  folder const here;
  write_capture(here / "capture");
  gart::write_splat_ply(here / "start.ply", one_gaussian());
  REQUIRE(here.gart("train capture --out run --start start.ply --iterations 3 --densify none" + small).code == 0);
  auto const header = text_of(here / "run/model.ply");
  auto const comment = header.find("comment gart near 0.00");
  REQUIRE(comment != std::string::npos);
  CHECK(header.find("comment", comment + 1) == std::string::npos);
  auto const model = gart::read_splat_ply(here / "run/model.ply");
  CHECK(model.size() == 1);
  CHECK(model.sh_degree == 1);
  CHECK(here.gart("train capture --out none --start start.ply --max-gaussians 0").code == 2);

  // The checkpoint has all: it goes on from anywhere, without the model.
  REQUIRE(
      here.gart("train capture --out part --start start.ply --iterations 3 --stop-at 1 --densify none" + small).code ==
      130);
  CHECK(here.json("part/config.json")["options"]["start"] == (here / "start.ply").string());
  fs::remove(here / "start.ply");
  auto const resumed = here.gart("train --resume --out part");
  REQUIRE_MESSAGE(resumed.code == 0, resumed.err);
  CHECK(text_of(here / "part/model.ply") == text_of(here / "run/model.ply"));
}

TEST_CASE("a run without test views says so instead of scoring nothing") {
  folder const here;
  write_capture(here / "capture", 3, 0);
  auto const run = here.gart("train capture --out run --iterations 3" + small);
  REQUIRE_MESSAGE(run.code == 0, run.err);
  CHECK(here.json("run/metrics.json")["psnr"].is_null());
  CHECK(has(text_of(here / "run/report.html"), "no test views"));
  auto const eval = here.gart("eval run/model.ply capture --out scores.json");
  CHECK(eval.code == 1);
  CHECK(has(eval.err, "no test views"));
  CHECK_FALSE(fs::exists(here / "scores.json"));
}

TEST_CASE("exposures are learned, saved, resumed and used again") {
  folder const here;
  write_capture(here / "capture");
  std::string const train = "train capture --out run --iterations 60 --exposure on" + small;
  REQUIRE(here.gart(train + " --stop-at 30").code == 130);
  REQUIRE(here.gart("train --resume --out run --quiet").code == 0);
  REQUIRE(here.gart("train capture --out whole --iterations 60 --exposure on" + small).code == 0);
  CHECK(text_of(here / "run/exposures.json") == text_of(here / "whole/exposures.json"));

  auto const metrics = here.json("run/metrics.json");
  CHECK(metrics["exposure"] == true);
  CHECK(metrics.contains("psnr_own_colours"));
  CHECK(has(text_of(here / "run/report.html"), "exposure of the training views about it"));
  auto const exposures = here.json("run/exposures.json");
  CHECK(exposures["views"].size() == metrics["train_views"].get<std::size_t>());
  CHECK(exposures["views"][0]["matrix"].size() == 12);

  std::string const eval = "eval run/model.ply capture --quiet --backend serial --out ";
  REQUIRE(here.gart(eval + "with.json --exposures run/exposures.json").code == 0);
  REQUIRE(here.gart(eval + "without.json").code == 0);
  CHECK(here.json("with.json")["psnr"].get<double>() == doctest::Approx(metrics["psnr"].get<double>()).epsilon(1e-4));
  CHECK(here.json("without.json")["psnr"].get<double>() ==
        doctest::Approx(metrics["psnr_own_colours"].get<double>()).epsilon(1e-4));
  CHECK_FALSE(here.json("without.json").contains("psnr_own_colours"));

  std::string const render = "render run/model.ply capture --quiet --backend serial --out ";
  REQUIRE(here.gart(render + "exposed --exposures run/exposures.json").code == 0);
  REQUIRE(here.gart(render + "own").code == 0);
  auto const name = metrics["views"][0]["name"].get<std::string>() + ".png";
  CHECK(text_of(here / ("exposed/" + name)) != text_of(here / ("own/" + name)));

  auto const missing = here.gart(render + "no --exposures nowhere.json");
  CHECK(missing.code == 1);
  CHECK(has(missing.err, "nowhere.json"));

  // A run without them leaves no file of an earlier one.
  REQUIRE(here.gart("train capture --out run --iterations 5 --exposure off" + small).code == 0);
  CHECK_FALSE(fs::exists(here / "run/exposures.json"));
  CHECK(here.json("run/metrics.json")["exposure"] == false);
}

TEST_CASE("a lens's falloff is learned, saved, resumed and used again") {
  folder const here;
  write_capture(here / "capture");
  std::string const train = " --iterations 60 --exposure off --vignetting on" + small;
  REQUIRE(here.gart("train capture --out run" + train + " --stop-at 30").code == 130);
  REQUIRE(here.gart("train --resume --out run --quiet").code == 0);
  REQUIRE(here.gart("train capture --out whole" + train).code == 0);
  CHECK(text_of(here / "run/exposures.json") == text_of(here / "whole/exposures.json"));

  auto const metrics = here.json("run/metrics.json"), file = here.json("run/exposures.json");
  CHECK(metrics["vignetting"] == true);
  CHECK(metrics["exposure"] == false);
  CHECK(file["views"].empty());
  REQUIRE(file["lenses"].size() == 1);
  double corner = 1;
  for (auto const& k : file["lenses"][0]["falloff"]) corner += k.get<double>() / 3;
  REQUIRE(metrics["corner_gains"].size() == 1);
  CHECK(metrics["corner_gains"][0].get<double>() == doctest::Approx(corner).epsilon(1e-5));
  CHECK(has(text_of(here / "run/report.html"), "by the falloff learned on the training views"));

  std::string const eval = "eval run/model.ply capture --backend serial --out ";
  REQUIRE(here.gart(eval + "with.json --quiet --exposures run/exposures.json").code == 0);
  auto const without = here.gart(eval + "without.json");
  REQUIRE(without.code == 0);
  CHECK(has(without.out, "for those of photographs --exposures run/exposures.json"));
  CHECK(here.json("with.json")["psnr"].get<double>() == doctest::Approx(metrics["psnr"].get<double>()).epsilon(1e-4));
  CHECK(here.json("without.json")["psnr"].get<double>() ==
        doctest::Approx(metrics["psnr_own_colours"].get<double>()).epsilon(1e-4));

  // An object before a plain background says nothing of the corners.
  REQUIRE(here.gart("train capture --out run --iterations 5" + small).code == 0);
  CHECK_FALSE(fs::exists(here / "run/exposures.json"));
  CHECK(here.json("run/metrics.json")["vignetting"] == false);
}
