// The errors that `gart tradeoff` reports, where they are known, and what it leaves; the presets.

#include "program.hpp"

#include <support/policies.hpp>

#include <train/train_arguments.hpp>

#include <random>

using namespace cli_test;

namespace {

// Two walls in front of the capture's first camera, each opaque to the clamp at 0.99: grey, and white behind it.
gart::gaussian_model walls() {
  constexpr float y0 = 0.28209479177387814f;
  gart::gaussian_model m;
  m.resize(2, 0);
  m.mean = {1, 0, 0, -1, 0, 0};
  for (int i = 0; i < 2; ++i) {
    m.log_scale[3 * i] = -3, m.log_scale[3 * i + 1] = m.log_scale[3 * i + 2] = 6;
    m.quaternion[4 * i] = 1;
    m.opacity[i] = 30;
    for (int c = 0; c < 3; ++c) m.sh[3 * i + c] = i == 0 ? 0 : 0.5f / y0;
  }
  return m;
}

gart::gaussian_model cloud() {
  std::mt19937_64 engine(3);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(120, 2);
  for (auto& x : m.mean) x = 0.5f * normal(engine);
  for (auto& x : m.log_scale) x = -1.5f + 0.4f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = 1 + normal(engine);
  for (auto& x : m.sh) x = 0.4f * normal(engine);
  return m;
}

nlohmann::json setting(nlohmann::json const& result, std::string const& name) {
  for (auto const& s : result["settings"])
    if (s["name"] == name) return s;
  FAIL("no setting " << name << " in tradeoff.json");
  return {};
}

}  // namespace

TEST_CASE("tradeoff reports the errors that can be worked out by hand") {
  folder const here;
  write_capture(here / "capture");
  gart::write_splat_ply(here / "walls.ply", walls());
  auto const run = here.gart(
      "tradeoff walls.ply capture --out trade --backend serial --views 1 --repeats 1 --quiet "
      "--settings transmittance_min,resolution=1/2");
  REQUIRE_MESSAGE(run.code == 0, run.err);
  auto const result = here.json("trade/tradeoff.json");
  CHECK(result["pixels"] == 256);

  auto const exact = setting(result, "exact");
  CHECK(exact["image"]["max"].get<double>() < 1e-6);
  CHECK(exact["gradient_worst"].get<double>() < 1e-5);
  CHECK(exact["gradients"]["opacity"] == 0);  // the clamp lets nothing through
  CHECK(exact["total_ms"].get<double>() > 0);

  // The ray ends at the first wall: 0.01 of 0.99 white is lost, and with it the second wall's share of the gradient.
  auto const ended = setting(result, "transmittance_min=0.05");
  CHECK(ended["image"]["max"].get<double>() == doctest::Approx(0.0099).epsilon(1e-4));
  CHECK(ended["image"]["rms"].get<double>() == doctest::Approx(0.0099).epsilon(1e-4));
  CHECK(ended["image"]["psnr"].get<double>() == doctest::Approx(-20 * std::log10(0.0099)).epsilon(1e-4));
  CHECK(ended["gradients"]["sh"].get<double>() == doctest::Approx(0.01 / std::sqrt(1.0001)).epsilon(1e-3));
  CHECK(setting(result, "transmittance_min=0")["image"]["max"].get<double>() < 1e-6);

  // What is the same everywhere loses nothing by being traced at half the size, nor does its gradient.
  auto const half = setting(result, "resolution=1/2");
  CHECK(half["image"]["max"].get<double>() < 1e-6);
  CHECK(half["gradient_worst"].get<double>() < 1e-4);
}

TEST_CASE("tradeoff measures all knobs and finds the front") {
  folder const here;
  write_capture(here / "capture");
  gart::write_splat_ply(here / "cloud.ply", cloud());
  auto const run = here.gart("tradeoff cloud.ply capture --out trade --backend serial --repeats 2 --pixels 100");
  REQUIRE_MESSAGE(run.code == 0, run.err);
  CHECK(has(run.out, "PSNR"));
  CHECK(has(run.err, "reading views"));
  auto const result = here.json("trade/tradeoff.json");
  CHECK(result["pixels"] == 200);
  CHECK(result["gradient_of"] == "the training loss");

  auto const error = [&](std::string const& name) { return setting(result, name)["image"]["rms"].get<double>(); };
  CHECK(error("exact") < 1e-4);
  CHECK(error("transmittance_min=0.01") < error("transmittance_min=0.05"));
  CHECK(error("exact") < error("transmittance_min=0.01"));
  CHECK(error("exact") < error("max_hits=8"));
  CHECK(error("alpha_min=0.02") < error("alpha_min=0.05"));
  CHECK(error("exact") < error("resolution=1/2"));
  CHECK(error("resolution=1/2") < error("resolution=1/4"));
  CHECK(error("exact") < error("sh_degree=1"));
  CHECK(setting(result, "sh_degree=0")["gradients"]["sh"].get<double>() > 0.1);
  CHECK(setting(result, "sh_degree=0")["gradients"]["sh"].get<double>() < 1.5);
  // A file of the model, and the image of what comes back from it; its Gaussians may be in another order.
  CHECK(error("format=glb") == doctest::Approx(error("exact")).epsilon(1e-3));
  CHECK(error("format=compressed.ply") > error("exact"));
  CHECK(error("format=compressed.ply") < error("format=splat"));
  CHECK(setting(result, "format=splat")["sh_degree"] == 0);
  CHECK(setting(result, "format=splat")["file_bytes"] == 120 * 32);
  CHECK(setting(result, "format=splat")["gradient_worst"].is_null());
  CHECK(setting(result, "exact")["file_bytes"].is_null());
  CHECK_FALSE(fs::exists(here / "trade/packed.splat"));
  CHECK(setting(result, "backward=pixel")["gradient_worst"].get<double>() < 1e-3);
  // A tree that was refitted while the Gaussians moved there and back finds the same hits.
  CHECK(error("rebuild_every=4") == error("exact"));
  CHECK(setting(result, "rebuild_every=4")["stages_ms"]["bvh build"].get<double>() > 0);

  std::string absent;
  for (auto const& a : result["absent"]) absent += a["name"].get<std::string>() + " ";
  CHECK(has(absent, "tracer=tiles"));  // for openmp and cuda
  for (char const* row : {"backward=deterministic", "kernel_degree=4", "hit_format=half"})
    CHECK_MESSAGE(has(absent, row), row);
  auto const table = text_of(here / "trade/table.txt");
  CHECK(has(table, "absent  tracer=tiles"));
  CHECK(has(run.out, table));

  bool any = false;
  for (auto const& s : result["settings"]) {
    bool beaten = false;
    for (auto const& o : result["settings"]) {
      if (o["gradient_worst"].is_null()) continue;
      beaten |= o["total_ms"] <= s["total_ms"] && o["gradient_worst"] <= s["gradient_worst"] &&
                (o["total_ms"] < s["total_ms"] || o["gradient_worst"] < s["gradient_worst"]);
    }
    if (!s["gradient_worst"].is_null()) CHECK(s["front"]["gradients"] == !beaten);
    any |= s["front"]["image"].get<bool>();
  }
  CHECK(any);
  auto const page = text_of(here / "trade/tradeoff.html");
  CHECK(has(page, "<polyline"));
  CHECK(has(page, "class=\"dim\""));
  CHECK(has(page, "tracer=tiles"));
  CHECK_FALSE(has(page, "http"));
}

TEST_CASE("tradeoff takes cameras alone and refuses what it cannot do") {
  folder const here;
  gart::write_splat_ply(here / "cloud.ply", cloud());
  gart::write_file(here / "path.json",
                   R"([{"name": "a", "width": 12, "height": 10, "fx": 12, "fy": 12, "cx": 6, "cy": 5,
                        "c2w": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -4], [0, 0, 0, 1]]}])");
  auto const run = here.gart(
      "tradeoff cloud.ply path.json --out trade --backend serial --settings transmittance_min=0.05 --repeats 1");
  REQUIRE_MESSAGE(run.code == 0, run.err);
  auto const result = here.json("trade/tradeoff.json");
  CHECK(result["settings"].size() == 2);
  CHECK(has(result["gradient_of"].get<std::string>(), "random"));
  CHECK(has(text_of(here / "trade/tradeoff.html"), "<h2>Image</h2>"));
  auto const alone =
      here.gart("tradeoff cloud.ply path.json --out alone --backend serial --settings exact --views 1 --repeats 1");
  REQUIRE_MESSAGE(alone.code == 0, alone.err);
  auto const page = text_of(here / "alone/tradeoff.html");
  for (char const* heading : {"<h2>Image</h2>", "<h2>Gradients</h2>"}) CHECK_FALSE(has(page, heading));
  CHECK(has(page, "pixels of 1 view; gradients of"));

  auto const unknown = here.gart("tradeoff cloud.ply path.json --out none --settings speed");
  CHECK(unknown.code == 2);
  CHECK_MESSAGE(has(unknown.err, "--settings speed: no such knob or setting; there are exact, alpha_min"), unknown.err);
  auto const no_model = here.gart("tradeoff none.ply path.json --out none");
  CHECK(no_model.code == 1);
  CHECK(has(no_model.err, "none.ply"));
  gart::write_file(here / "empty.json", "[]");
  auto const no_cameras = here.gart("tradeoff cloud.ply empty.json --out none");
  CHECK(no_cameras.code == 1);
  CHECK(has(no_cameras.err, "empty.json: holds no camera"));
  CHECK_FALSE(fs::exists(here / "none"));
}

TEST_CASE("a preset sets what the command line leaves open") {
  folder const here;
  write_capture(here / "capture");
  std::string const tiny = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet --no-auto --stop-at 1";
  REQUIRE(here.gart("train capture --out half --preset quick" + tiny).code == 130);
  CHECK(here.json("half/config.json")["options"]["iterations"] == gart_cli::quick_iterations);
  auto const other = here.gart("train --resume --out half --preset exact");
  CHECK(other.code == 2);
  CHECK_MESSAGE(has(other.err, "--preset \"exact\": the run to be resumed has \"quick\""), other.err);
  REQUIRE(here.gart("train capture --out own --preset quick --iterations 4" + tiny).code == 130);
  CHECK(here.json("own/config.json")["options"]["iterations"] == 4);
  REQUIRE(here.gart("train --resume --out own").code == 0);
  CHECK(here.json("own/metrics.json")["approximations"]["preset"] == "quick");
  CHECK(has(text_of(here / "own/report.html"), "preset quick"));
}

TEST_CASE("a model and its report say what a run left out of images") {
  folder const here;
  write_capture(here / "capture");
  std::string const small = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet --iterations 2 ";
  REQUIRE(here.gart("train capture --out plain" + small).code == 0);
  auto const plain = here.json("plain/metrics.json")["approximations"];
  CHECK(plain["alpha_min"].get<double>() == doctest::Approx(1.0 / 255));
  CHECK(plain["transmittance_min"].get<double>() == doctest::Approx(1e-4));
  REQUIRE(here.gart("train capture --out run --alpha-min 0.01 --transmittance-min 0.125" + small).code == 0);
  auto const left_out = here.json("run/metrics.json")["approximations"];
  CHECK(left_out["transmittance_min"] == 0.125);
  CHECK(left_out["alpha_min"].get<double>() == doctest::Approx(0.01));
  CHECK(has(text_of(here / "run/model.ply"), "comment gart alpha_min"));
}
