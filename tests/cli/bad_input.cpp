// Input that cannot be used: exit code 1, one clear line, and nothing half-written.

#include "program.hpp"

#include <support/policies.hpp>

#include <limits>

using namespace cli_test;

namespace {

void fails(outcome const& result, std::vector<std::string> const& says) {
  CHECK(result.code == 1);
  CHECK(has(result.err, "gart: error: "));
  for (auto const& part : says) CHECK_MESSAGE(has(result.err, part), part << " in: " << result.err);
}

}  // namespace

TEST_CASE("a capture that is not there, or has no images") {
  folder const here;
  fails(here.gart("train nowhere --out run"), {"nowhere"});
  fs::create_directories(here / "empty");
  fails(here.gart("train empty --out run"), {"empty"});
  write_capture(here / "none", 0, 0);
  fails(here.gart("train none --out run"), {"transforms_train.json"});
  write_capture(here / "broken");
  gart::write_file(here / "broken/train/v1.png", "not an image");
  fails(here.gart("train broken --out run"), {"v1.png"});
  CHECK_FALSE(fs::exists(here / "run"));
}

TEST_CASE("arguments in each other's place, or a run's folder for its model") {
  folder const here;
  write_capture(here / "cap");
  fs::create_directories(here / "run");
  gart::write_splat_ply(here / "run/model.ply", one_gaussian());
  for (std::string const command : {"render % --out made", "eval % --out made/scores.json", "view %", "bench %"}) {
    CAPTURE(command);
    auto const with = [&](std::string const& files) {
      return std::string(command).replace(command.find('%'), 1, files);
    };
    bool const cameras_first = has(command, "render");
    fails(here.gart(with("cap run/model.ply")),
          {cameras_first ? "run/model.ply: is a model" : "cap: is a capture", "swapped"});
    fails(here.gart(with("run cap")), {"run: is the folder of a training (name run/model.ply)"});
  }
  CHECK_FALSE(fs::exists(here / "made"));
}

TEST_CASE("an --out that is no folder is refused before training") {
  folder const here;
  write_capture(here / "capture");
  gart::write_file(here / "taken", "mine");
  for (std::string const out : {"taken", "taken/run", "/proc/run"}) {
    CAPTURE(out);
    fails(here.gart("train capture --iterations 100000000 --out " + out), {out});
  }
  CHECK(text_of(here / "taken") == "mine");
  gart::write_splat_ply(here / "model.ply", one_gaussian());
  fails(here.gart("render model.ply capture --out taken"), {"taken"});
  fails(here.gart("eval model.ply capture --out taken/scores.json"), {"taken"});
}

TEST_CASE("splat files with values that are not numbers, or cut short") {
  folder const here;
  write_capture(here / "capture");
  auto model = one_gaussian();
  model.mean[1] = std::numeric_limits<float>::quiet_NaN();
  gart::write_splat_ply(here / "nan.ply", model);
  model.mean[1] = 0, model.log_scale[2] = std::numeric_limits<float>::infinity();
  gart::write_splat_ply(here / "inf.ply", model);
  gart::write_splat_ply(here / "good.ply", one_gaussian());
  auto const good = text_of(here / "good.ply");
  gart::write_file(here / "cut.ply", std::string_view(good).substr(0, good.size() - 3));

  for (std::string const command : {"render %.ply capture --out made", "eval %.ply capture --out made/scores.json",
                                    "train capture --start %.ply --out made --iterations 2"}) {
    CAPTURE(command);
    auto const with = [&](std::string const& name) { return std::string(command).replace(command.find('%'), 1, name); };
    fails(here.gart(with("nan")), {"nan.ply", "y"});
    fails(here.gart(with("inf")), {"inf.ply", "scale_2"});
    fails(here.gart(with("cut")), {"cut.ply"});
    fails(here.gart(with("absent")), {"absent.ply"});
    CHECK_FALSE(fs::exists(here / "made/scores.json"));
  }
}

TEST_CASE("a model of another kernel is not drawn with this one") {
  folder const here;
  write_capture(here / "capture");
  gart::write_splat_ply(here / "k6.ply", one_gaussian(), {{"kernel_degree", "6"}});
  fails(here.gart("render k6.ply capture --out images"), {"k6.ply", "kernel_degree is '6'", "1, 2, 3, 4, 5 or 8"});
  gart::write_splat_ply(here / "k8.ply", one_gaussian(), {{"kernel_degree", "8"}});
  fails(here.gart("render k8.ply capture --out images"),
        {"k8.ply", "SH degree 0, kernel degree 8: ruled out by its kernel degree (others: 2", "gart info lists all",
         "examples/5_own_configuration"});
  gart::write_splat_ply(here / "cap.ply", one_gaussian(), {{"max_hits", "few"}});
  fails(here.gart("render cap.ply capture --out images"), {"cap.ply", "max_hits is 'few'"});
  gart::write_splat_ply(here / "a.ply", one_gaussian(), {{"alpha_min", "much"}});
  fails(here.gart("render a.ply capture --out images"), {"alpha_min", "much"});
}

TEST_CASE("a backend that this machine does not have") {
  folder const here;
  write_capture(here / "capture");
  // No device is visible, be one there or not.
  auto const run = here.gart("train capture --out run --backend cuda", "CUDA_VISIBLE_DEVICES=");
  fails(run, {"cuda"});
  if (has(here.gart("info").out, "cuda       not in this build"))
    fails(run, {"backend cuda: this gart was built without CUDA: use --backend openmp", "-DGART_CUDA=ON"});
  CHECK_FALSE(fs::exists(here / "run"));
}

TEST_CASE("a checkpoint that is damaged is refused and kept") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 20 --stop-at 5 --backend serial --max-gaussians 60 --quiet")
              .code == 130);
  auto const whole = text_of(here / "run/checkpoint.gart");
  gart::write_file(here / "run/checkpoint.gart", std::string_view(whole).substr(0, whole.size() / 2));
  fails(here.gart("train --resume --out run"), {"checkpoint.gart"});
  CHECK(text_of(here / "run/checkpoint.gart").size() == whole.size() / 2);
  gart::write_file(here / "run/checkpoint.gart", whole);
  std::string flipped = whole;
  flipped[flipped.size() / 2] ^= 1;
  gart::write_file(here / "run/checkpoint.gart", flipped);
  fails(here.gart("train --resume --out run"), {"checkpoint.gart", "checksum"});
  gart::write_file(here / "run/checkpoint.gart", whole);
  auto const history = text_of(here / "run/history.json");
  gart::write_file(here / "run/history.json", "[]");
  fails(here.gart("train --resume --out run"), {"history.json", "\"train\""});
  gart::write_file(here / "run/history.json", history);
  std::string config = text_of(here / "run/config.json");
  config.replace(config.find("\"iterations\": 20"), 16, "\"iterations\": -3");
  gart::write_file(here / "run/config.json", config);
  fails(here.gart("train --resume --out run"), {"config.json", "iterations", "'-3' is not a number from 1"});
  gart::write_file(here / "run/config.json", "{\"options\": {");
  fails(here.gart("train --resume --out run"), {"config.json", "JSON"});
}
