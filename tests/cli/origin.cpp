// A capture in survey coordinates is trained, shown and exported as the same one at zero.

#include "program.hpp"

#include <gart/io/camera_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/origin.hpp>

#include <doctest/doctest.h>

using namespace cli_test;
using gart::vec3d;

namespace {

vec3d const survey(5e5, 4e6, 100);

// The same capture somewhere else, its points in double.
void write_shifted(fs::path const& at, vec3d const& by) {
  write_capture(at);
  for (char const* split : {"train", "test"}) {
    fs::path const file = at / (std::string("transforms_") + split + ".json");
    auto json = nlohmann::json::parse(text_of(file));
    for (auto& frame : json["frames"])
      for (int k = 0; k < 3; ++k)
        frame["transform_matrix"][static_cast<std::size_t>(k)][3] =
            frame["transform_matrix"][static_cast<std::size_t>(k)][3].get<double>() + by[k];
    gart::write_file(file, json.dump());
  }
  gart::write_point_ply(at / "points3d.ply", gart::read_point_ply(at / "points3d.ply"), by);
}

}  // namespace

TEST_CASE("survey coordinates train as those near zero, in all formats") {
  folder const here;
  write_shifted(here / "zero", vec3d(0.0)), write_shifted(here / "far", survey);
  auto const run = [&](std::string const& arguments) {
    auto const done = here.gart(arguments);
    REQUIRE_MESSAGE(done.code == 0, done.err);
    return done.out + done.err;
  };
  std::string const small =
      " --iterations 400 --backend serial --max-gaussians 60 --exposure on --sh-degree 1 --seed 3";
  CHECK_FALSE(has(run("train zero --out run_zero" + small), "origin"));
  CHECK(has(run("train far --out run_far" + small), "coordinates are held from the origin 500000,4000000,100"));
  auto const psnr = [&](std::string const& file) { return here.json(file)["psnr"].get<double>(); };
  double const zero = psnr("run_zero/metrics.json"), far = psnr("run_far/metrics.json");
  MESSAGE(zero, " dB at zero, ", far, " dB far from it");
  CHECK(zero > 15);
  CHECK(std::abs(far - zero) < 0.1);
  CHECK_FALSE(has(text_of(here / "run_zero/model.ply").substr(0, 400), "origin"));
  CHECK(has(text_of(here / "run_far/model.ply").substr(0, 400), "comment gart origin 500000,4000000,100\n"));
  CHECK(has(run("info run_far/model.ply"), "origin     500000,4000000,100"));
  CHECK(has(run("info far"), "origin     500000,4000000,100"));
  CHECK(has(run("info zero"), "origin     none"));
  // Exposures have the capture's coordinates.
  CHECK(has(text_of(here / "run_far/exposures.json"), "40000"));

  // Each format keeps it; what has no room is told it again.
  auto const eval = [&](std::string const& model) {
    run("eval " + model + " far --out scores.json --backend serial --quiet");
    return psnr("scores.json");
  };
  double const exact = eval("run_far/model.ply");
  for (std::string const name :
       {"m.compressed.ply", "m.spz", "m.sog", "m.glb", "world.ply --world", "world.glb --world"}) {
    CAPTURE(name);
    auto const converted = here.gart("convert run_far/model.ply " + name);
    if (converted.code != 0 && has(converted.err, "install lib")) continue;
    REQUIRE_MESSAGE(converted.code == 0, converted.err);
    CHECK(has(converted.out, "from the origin 500000,4000000,100") != has(name, "--world"));
    CHECK(std::abs(eval(name.substr(0, name.find(' '))) - exact) < 0.5);
  }
  CHECK(has(run("convert run_far/model.ply m.splat"), "left out: origin 500000,4000000,100"));
  run("convert m.splat told.ply --origin 500000,4000000,100");
  CHECK(std::abs(eval("told.ply") - eval("m.splat")) > 1);
  auto const twice = here.gart("convert told.ply twice.ply --origin 1,2,3");
  CHECK(twice.code == 2);
  CHECK_MESSAGE(has(twice.err, "--origin 1,2,3: told.ply says that it is from the origin 500000,4000000,100"),
                twice.err);
  CHECK_FALSE(fs::exists(here / "twice.ply"));
  run("convert world.ply back.ply");
  CHECK(gart::read_splat_ply(here / "back.ply").mean.size() ==
        gart::read_splat_ply(here / "run_far/model.ply").mean.size());

  // Cameras in files are the capture's own, of a model with its exposures.
  gart::write_cameras(here / "keys.json", gart::load_cameras(here / "far"));
  run("render run_far/model.ply far --out by_capture --backend serial --quiet --exposures run_far/exposures.json");
  run("render run_far/model.ply keys.json --out by_file --backend serial --quiet --exposures run_far/exposures.json");
  run("render run_far/model.ply --path keys.json --frames 3 --out path --backend serial --quiet");
  std::size_t images = 0;
  for (auto const& file : fs::directory_iterator(here / "by_capture")) {
    ++images;
    CHECK(text_of(file.path()) == text_of(here / "by_file" / file.path().filename().string()));
  }
  CHECK(images == 6);
  auto const last = gart::read_image(here / "path/frame_00002.png");
  CHECK(*std::max_element(last.data.begin(), last.data.end()) > 50);

  // It goes on where it was, from a model of another origin too, and not from a checkpoint of one.
  run("train --resume --out run_far --iterations 410 --quiet");
  run("train far --start run_far/model.ply --out again --iterations 1 --backend serial --quiet");
  run("train far --start world.ply --out started --iterations 1 --backend serial --quiet");
  CHECK(psnr("started/metrics.json") == doctest::Approx(psnr("again/metrics.json")).epsilon(0.01));
  fs::copy_file(here / "run_zero/checkpoint.gart", here / "run_far/checkpoint.gart",
                fs::copy_options::overwrite_existing);
  auto const other = here.gart("train --resume --out run_far --iterations 420 --quiet");
  CHECK(other.code == 1);
  CHECK(has(other.err, "the state is from the origin 0,0,0, the capture from 500000,4000000,100"));

  // The run says its origin. One of an earlier gart says none, and is from zero, as that checkpoint is.
  auto config = here.json("run_far/config.json");
  CHECK(config["origin"] == nlohmann::json({5e5, 4e6, 100.0}));
  config["origin"] = {1, 2};
  gart::write_file(here / "run_far/config.json", config.dump());
  auto const wrong = here.gart("train --resume --out run_far --iterations 420 --quiet");
  CHECK(wrong.code == 1);
  CHECK_MESSAGE(has(wrong.err, "config.json: 'origin' is not a list of 3 numbers"), wrong.err);
  config.erase("origin"), config.erase("checksums");
  gart::write_file(here / "run_far/config.json", config.dump());
  run("train --resume --out run_far --iterations 420 --quiet");
}
