// --antialias of a run, the mark in its model, and --samples of a picture.

#include "program.hpp"

#include <support/policies.hpp>

#include <algorithm>
#include <cmath>

using namespace cli_test;

namespace {

std::string const small = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet ";

void without(std::string& text, std::string const& part) {
  REQUIRE(has(text, part));
  text.erase(text.find(part), part.size());
}

// The largest difference of two pictures, of 255.
int difference(fs::path const& a, fs::path const& b) {
  gart::image8 const x = gart::read_image(a), y = gart::read_image(b);
  REQUIRE(x.data.size() == y.data.size());
  int worst = 0;
  for (std::size_t i = 0; i < x.data.size(); ++i) worst = std::max(worst, std::abs(int{x.data[i]} - y.data[i]));
  return worst;
}

}  // namespace

TEST_CASE("every command shows an antialiased model as it was trained") {
  folder const here;
  write_capture(here / "capture");
  auto const run = here.gart("train capture --out run --iterations 20 --antialias --stop-at 10" + small);
  REQUIRE_MESSAGE(run.code == 130, run.err);
  REQUIRE(here.gart("train --resume --out run --quiet").code == 0);
  REQUIRE(here.gart("train capture --out whole --iterations 20 --antialias" + small).code == 0);
  REQUIRE(here.gart("train capture --out plain --iterations 20" + small).code == 0);
  std::string text = text_of(here / "run/model.ply");
  CHECK(text == text_of(here / "whole/model.ply"));
  CHECK_FALSE(has(text_of(here / "plain/model.ply"), "antialias"));
  CHECK_FALSE(has(text_of(here / "plain/model.ply"), "SplatRenderMode"));
  REQUIRE(here.gart("train capture --out narrow --iterations 5 --set render.antialias=0.25" + small).code == 0);
  CHECK(has(text_of(here / "narrow/model.ply"), "comment gart antialias 0.25\n"));
  CHECK(here.json("narrow/metrics.json")["approximations"]["antialias"] == 0.25);
  std::string const own = "comment gart antialias 0.300000012\n", mark = "comment SplatRenderMode: mip\n";
  CHECK(has(text, own));
  CHECK(has(text, mark));

  auto const metrics = here.json("run/metrics.json");
  CHECK(metrics["approximations"]["antialias"].get<double>() == doctest::Approx(0.3));
  CHECK(here.json("plain/metrics.json")["approximations"]["antialias"] == 0);
  REQUIRE(here.gart("eval run/model.ply capture --out scores.json --renders views --backend serial").code == 0);
  auto const scores = here.json("scores.json");
  CHECK(scores["approximations"]["antialias"] == metrics["approximations"]["antialias"]);
  CHECK(scores["psnr"].get<double>() == doctest::Approx(metrics["psnr"].get<double>()).epsilon(1e-6));
  REQUIRE(here.gart("render run/model.ply capture --out images --json render.json --backend serial").code == 0);
  CHECK(here.json("render.json")["approximations"]["antialias"] == metrics["approximations"]["antialias"]);
  for (auto const& view : scores["views"]) {
    auto const name = view["name"].get<std::string>() + ".png";
    CHECK(text_of(here / ("images/" + name)) == text_of(here / ("run/renders/" + name)));
  }
  // The reference in double sees through the same filter.
  REQUIRE(here.gart("tradeoff run/model.ply capture --out table --settings transmittance_min=0 --repeats 1 --backend "
                    "serial --quiet")
              .code == 0);
  auto const exact = here.json("table/tradeoff.json")["settings"][0];
  CHECK(exact["approximations"]["antialias"] == metrics["approximations"]["antialias"]);
  CHECK(exact["image"]["max"].get<double>() < 1e-3);
  CHECK(exact["gradient_worst"].get<double>() < 1e-2);

  // Another program's model, marked in its way; and one that is not marked.
  without(text, own);
  gart::write_file(here / "foreign.ply", text);
  REQUIRE(here.gart("eval foreign.ply capture --out foreign.json --backend serial --quiet").code == 0);
  CHECK(here.json("foreign.json")["psnr"] == scores["psnr"]);
  without(text, mark);
  gart::write_file(here / "bare.ply", text);
  REQUIRE(here.gart("eval bare.ply capture --out bare.json --backend serial --quiet").code == 0);
  CHECK(here.json("bare.json")["psnr"] != scores["psnr"]);

  gart::write_splat_ply(here / "wrong.ply", one_gaussian(), {{"antialias", "wide"}});
  auto const wrong = here.gart("render wrong.ply capture --out none");
  CHECK(wrong.code == 1);
  CHECK_MESSAGE(has(wrong.err, "wrong.ply: comment gart antialias is 'wide'"), wrong.err);
}

TEST_CASE("--samples N is the mean of a picture N times as large") {
  folder const here;
  write_capture(here / "capture");
  gart::gaussian_model model = one_gaussian();
  model.log_scale = {-3.0f, -4.0f, -1.0f};  // a needle thinner than a pixel
  model.quaternion = {1, 0.3f, 0.2f, 0.5f};
  gart::write_splat_ply(here / "model.ply", model);
  auto const camera = [](int size) {
    double const f = size * 1.3;
    nlohmann::json c = {{"name", "view"},   {"width", size},
                        {"height", size},   {"fx", f},
                        {"fy", f},          {"cx", 0.5 * size},
                        {"cy", 0.5 * size}, {"c2w", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, -4}, {0, 0, 0, 1}}}};
    return nlohmann::json::array({c});
  };
  constexpr int size = 16, n = 4;
  gart::write_file(here / "small.json", camera(size).dump());
  gart::write_file(here / "large.json", camera(size * n).dump());
  std::string const backend = " --backend serial --quiet";
  REQUIRE(here.gart("render model.ply small.json --out one" + backend).code == 0);
  REQUIRE(here.gart("render model.ply large.json --out large" + backend).code == 0);
  auto const sampled = here.gart("render model.ply small.json --out many --depth --json t.json --samples 4" + backend);
  REQUIRE_MESSAGE(sampled.code == 0, sampled.err);
  CHECK(here.json("t.json")["samples"] == n);
  CHECK(fs::exists(here / "many/view_depth.png"));
  gart::image8 const large = gart::read_image(here / "large/view.png");
  gart::image8 const many = gart::read_image(here / "many/view.png");
  double worst = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int k = 0; k < n * n; ++k) sum += large.at(x * n + k % n, y * n + k / n, c);
        worst = std::max(worst, std::abs(sum / (n * n) - many.at(x, y, c)));
      }
  CHECK(worst <= 1);  // of 255, by the rounding of both
  CHECK(difference(here / "one/view.png", here / "many/view.png") > 20);
  CHECK(here.gart("render model.ply small.json --out none --samples 0").code == 2);
}
