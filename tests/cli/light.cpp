// gart render --scene: pictures by paths of light, from a scene that has all or from a model beside it.

#include "program.hpp"

#include <gart/io/exr_file.hpp>
#include <gart/io/splat_file.hpp>

#include <doctest/doctest.h>

#include <string>

using namespace cli_test;

namespace {

// One large Gaussian of a colour at z = 6.
void write_model(fs::path const& at) {
  gart::gaussian_model m;
  m.resize(1, 0);
  m.mean = {0, 0, 6}, m.log_scale = {1, 1, -3}, m.quaternion = {1, 0, 0, 0}, m.opacity = {9};
  m.sh = {1.0f, 0.0f, -1.0f};
  gart::write_splats(at, m);
}

constexpr char camera[] =
    R"({"name": "a", "width": 16, "height": 16, "fx": 16, "fy": 16, "cx": 8, "cy": 8,
        "c2w": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]})";

// A box that shines green stands to the left, before the Gaussian.
std::string scene(std::string const& models) {
  return R"({)" + models + R"("materials": [{"name": "lamp", "base_color": [0, 0, 0], "emission": [0, 1, 0]}],
    "meshes": [{"shape": "box", "material": "lamp", "translation": [-3, 0, 4]}], "cameras": [)" +
         camera + "]}";
}

}  // namespace

TEST_CASE("gart render --scene draws what the scene says") {
  folder const here;
  write_model(here / "m.ply");
  gart::write_file(here / "s.json", scene(R"("models": [{"file": "m.ply"}],)"));
  auto const run = here.gart(
      "render --scene s.json --out out --samples 2 --images colour,depth,albedo,surface,ids --format exr --backend "
      "serial "
      "--json t.json");
  CHECK_MESSAGE(run.code == 0, run.err);
  gart::image8 const image = gart::read_image(here / "out/a.png");
  CHECK(image.at(0, 8, 1) == 255);  // the lamp
  CHECK(image.at(0, 8, 0) < 10);    // its gloss shows some of the Gaussian
  CHECK(image.at(12, 8, 0) > 150);  // the Gaussian
  CHECK(image.at(12, 8, 2) < 60);
  gart::image_float const ids = gart::read_exr(here / "out/a_ids.exr", "GMT"),
                          depth = gart::read_exr(here / "out/a_depth.exr", "Z"),
                          normal = gart::read_exr(here / "out/a_surface.exr", "XYZ");
  CHECK(ids.at(0, 8, 1) == 0);
  CHECK(ids.at(12, 8, 0) == 0);
  CHECK(ids.at(12, 8, 1) == -1);
  CHECK(normal.at(0, 8, 0) == doctest::Approx(1));
  CHECK(depth.at(12, 8, 0) > depth.at(0, 8, 0));
  CHECK(here.json("t.json")["samples"] == 2);

  // The same by a model on the command line.
  gart::write_file(here / "n.json", scene(""));
  auto const beside = here.gart("render m.ply --scene n.json --out out2 --samples 2 --backend serial");
  CHECK_MESSAGE(beside.code == 0, beside.err);
  CHECK(gart::read_image(here / "out2/a.png").data == image.data);
  // And cameras of their own.
  gart::write_file(here / "c.json", std::string("[") + camera + "]");
  auto const both = here.gart("render c.json --scene s.json --out out3 --samples 2 --backend serial --tone-map srgb");
  CHECK_MESSAGE(both.code == 0, both.err);
  CHECK(fs::exists(here / "out3/a.png"));
}

TEST_CASE("gart render --scene says what is wrong") {
  folder const here;
  write_model(here / "m.ply");
  gart::write_file(here / "s.json", scene(R"("models": [{"file": "n.ply"}],)"));
  auto const said = [&](std::string const& arguments, int code) {
    auto const run = here.gart("render " + arguments + " --out out");
    CHECK(run.code == code);
    return run.err;
  };
  CHECK(said("--scene s.json", 1).find("'n.ply', which is not there") != std::string::npos);
  CHECK(said("m.ply c.json --bounces 2", 2).find("--bounces is of a scene") != std::string::npos);
  CHECK(said("m.ply c.json --images ids", 2).find("is of a --scene") != std::string::npos);
  CHECK(said("--scene none.json", 1).find("none.json") != std::string::npos);
  CHECK(said("c.json", 2).find("CAMERAS is missing") != std::string::npos);
}
