// A run that begins at the poses that another one found.
#include "program.hpp"

#include <support/policies.hpp>

using namespace cli_test;

namespace {

std::string const fast = " --iterations 12 --max-gaussians 60 --sh-degree 0 --no-auto --quiet --backend openmp";
// Poses stay where they are.
std::string const still = " --refine-poses --set poses.rate=0,poses.rate_final=0";

double largest_difference(nlohmann::json const& a, nlohmann::json const& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t row = 0; row < 4; ++row)
      for (std::size_t k = 0; k < 4; ++k)
        largest = std::max(largest, std::abs(a[i]["c2w"][row][k].get<double>() - b[i]["c2w"][row][k].get<double>()));
  return largest;
}

}  // namespace

TEST_CASE("a run begins at another run's poses, by name") {
  folder const here;
  write_capture(here / "capture");
  auto const found = here.gart("train capture --out first --refine-poses --set poses.rate=0.05,poses.warm_up=0" + fast);
  REQUIRE_MESSAGE(found.code == 0, found.err);
  REQUIRE(here.gart("train capture --out unmoved" + still + fast).code == 0);
  auto poses = here.json("first/poses.json");
  REQUIRE(poses.size() == 4);
  REQUIRE(largest_difference(poses, here.json("unmoved/poses.json")) > 1e-3);

  std::reverse(poses.begin(), poses.end());  // names tell whose is whose
  gart::write_file(here / "poses.json", poses.dump());
  auto const again = here.gart("train capture --out again --downscale 2 --poses poses.json" + still + fast);
  REQUIRE_MESSAGE(again.code == 0, again.err);
  CHECK(largest_difference(here.json("first/poses.json"), here.json("again/poses.json")) < 1e-6);
  CHECK(here.json("again/poses.json")[0]["width"] == 8);

  // It goes on from anywhere, and from nothing else.
  CHECK(fs::path(here.json("again/config.json")["options"]["poses"].get<std::string>()).is_absolute());
  REQUIRE(here.gart("train --resume --out again --iterations 14 --quiet").code == 0);
  CHECK(largest_difference(here.json("first/poses.json"), here.json("again/poses.json")) < 1e-6);
  poses[0]["c2w"][0][3] = 1;
  gart::write_file(here / "poses.json", poses.dump());
  auto const changed = here.gart("train --resume --out again --iterations 16 --quiet");
  CHECK(changed.code == 2);
  CHECK_MESSAGE(has(changed.err, "poses.json: is not what the run to be resumed began at"), changed.err);
}

TEST_CASE("poses that a run cannot begin at are refused by view") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out first" + still + fast).code == 0);
  auto const refused = [&](std::string const& options, int code, std::string const& sign) {
    auto const run = here.gart("train capture --out run " + options + fast);
    CAPTURE(options);
    CHECK(run.code == code);
    CHECK_MESSAGE(has(run.err, sign), run.err);
    CHECK_FALSE(fs::exists(here / "run"));
  };
  refused("--poses first/poses.json", 2, "first/poses.json: needs --refine-poses");
  refused("--poses absent.json" + still, 1, "absent.json");
  auto poses = here.json("first/poses.json");
  poses[2]["name"] = "another";
  gart::write_file(here / "other.json", poses.dump());
  refused("--poses other.json" + still, 1, "other.json: has no camera named '");
  poses = here.json("first/poses.json");
  poses[1]["shutter_type"] = "ROLLING_TOP_TO_BOTTOM", poses[1]["c2w_end"] = poses[0]["c2w"];
  gart::write_file(here / "rolling.json", poses.dump());
  refused("--poses rolling.json" + still, 1, "has shutter_type ROLLING_TOP_TO_BOTTOM, the capture GLOBAL");

  auto const own = here.gart("train capture --out first --poses first/poses.json" + still + fast);
  CHECK(own.code == 2);
  CHECK_MESSAGE(has(own.err, "is of the run in --out"), own.err);
  CHECK(fs::exists(here / "first/poses.json"));
}
