// Configurations chosen by what a model is and what is traded: by the program's own options and files.

#include "program.hpp"

#include <support/policies.hpp>

#include <array>
#include <cmath>

using namespace cli_test;

TEST_CASE("SH degree 0 stores and optimises 14 floats a Gaussian") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(
      here.gart("train capture --out run --iterations 3 --sh-degree 0 --densify none --backend serial --quiet").code ==
      0);
  std::string const ply = text_of(here / "run/model.ply");
  CHECK_FALSE(has(ply, "f_rest"));
  // Beside the 14: the format's normal, three zeros.
  std::string const end = "end_header\n";
  CHECK(ply.size() == ply.find(end) + end.size() + 40 * 4 * (14 + 3));
  // Parameters and two moments; names, lengths and counters beside.
  CHECK(fs::file_size(here / "run/checkpoint.gart") < 40 * 3 * 4 * 14 + 1000);
}

TEST_CASE("a configuration not compiled is refused with what rules it out") {
  folder const here;
  write_capture(here / "capture");
  auto const run = here.gart("train capture --out run --sh-degree 1 --tracer embree --backend serial");
  CHECK(run.code == 1);
  CHECK_MESSAGE(has(run.err, "backend serial, tracer embree, backward auto, SH degree 1: ruled out by its "), run.err);
  CHECK_MESSAGE(has(run.err, "by its tracer (others: bvh"), run.err);
  CHECK(has(run.err, "gart info lists all"));
  CHECK(run.err.size() < 400);
  CHECK(has(run.err, "GART_REGISTER_CONFIGURATIONS"));
  CHECK(has(run.err, "examples/5_own_configuration"));
  CHECK_FALSE(fs::exists(here / "run"));
}

#if defined(GART_VARIANTS)
namespace {
std::string const openmp = " --iterations 10 --backend openmp --max-gaussians 60 --quiet ";
}  // namespace

TEST_CASE("a model's file keeps its kernel degree") {
  folder const here;
  write_capture(here / "capture");
  auto const run = here.gart("train capture --out run --kernel-degree 4" + openmp);
  REQUIRE_MESSAGE(run.code == 0, run.err);
  CHECK(here.json("run/metrics.json")["kernel_degree"] == 4);
  std::string ply = text_of(here / "run/model.ply");
  std::string const comment = "comment gart kernel_degree 4\n";
  REQUIRE(has(ply, comment));
  REQUIRE(here.gart("eval run/model.ply capture --out scores.json --backend openmp --quiet").code == 0);
  double const psnr = here.json("scores.json")["psnr"];
  CHECK(psnr == doctest::Approx(here.json("run/metrics.json")["psnr"].get<double>()).epsilon(1e-6));
  ply.erase(ply.find(comment), comment.size());
  gart::write_file(here / "plain.ply", ply);
  REQUIRE(here.gart("eval plain.ply capture --out plain.json --backend openmp --quiet").code == 0);
  CHECK(std::abs(here.json("plain.json")["psnr"].get<double>() - psnr) > 0.01);
  CHECK(here.gart("train capture --out next --start run/model.ply" + openmp).code == 2);
}

TEST_CASE("what is traded is chosen by name and reported") {
  folder const here;
  write_capture(here / "capture");
  for (auto const& [option, name, value] : {std::array{"--hit-format half", "hit_format", "half"}}) {
    CAPTURE(option);
    auto const done = here.gart(std::string("train capture --out traded ") + option + openmp);
    REQUIRE_MESSAGE(done.code == 0, done.err);
    CHECK(here.json("traded/metrics.json")["approximations"][name] == value);
  }
}
#endif
