// gart train --check-finite: what it counts, and how it stops.
#include "program.hpp"

#include <support/policies.hpp>

#include <gart/train/state.hpp>

using namespace cli_test;

namespace {

std::string const small = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet ";

}  // namespace

TEST_CASE("--check-finite counts its steps and changes no bit") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out plain --iterations 20" + small).code == 0);
  REQUIRE(here.gart("train capture --out checked --iterations 20 --check-finite" + small).code == 0);
  CHECK(here.json("plain/metrics.json")["finite_steps"] == 0);
  CHECK_FALSE(here.json("plain/metrics.json")["stages_ms"].contains("finite/parameters"));
  CHECK(here.json("checked/metrics.json")["finite_steps"] == 20);
  CHECK(here.json("checked/metrics.json")["skipped_updates"] == 0);
  CHECK(here.json("checked/metrics.json")["stages_ms"].contains("finite/parameters"));
  CHECK(text_of(here / "plain/model.ply") == text_of(here / "checked/model.ply"));
}

TEST_CASE("--check-finite stops with 1 and names the place") {
  folder const here;
  write_capture(here / "capture");
  CHECK(here.gart("train capture --out run --iterations 20 --stop-at 10" + small).code == 130);
  auto state = gart::read_checkpoint(here / "run/checkpoint.gart");
  state.second.log_scale[3 * 17 + 2] = NAN;
  gart::write_checkpoint(here / "run/checkpoint.gart", state);
  auto const run = here.gart("train --resume --out run --check-finite");
  CHECK(run.code == 1);
  for (char const* part : {"step 11, view ", "1 number of Adam's second moment of log-scale is not finite",
                           "Gaussian 17, element 2 of 3: nan", "resumed from", "run/checkpoint.gart"}) {
    CHECK_MESSAGE(has(run.err, part), run.err);
  }
  CHECK_FALSE(fs::exists(here / "run/metrics.json"));
}
