// One page of several runs: whose scores, options, curves and views it has, and what it refuses.

#include "program.hpp"

#include <support/policies.hpp>

using namespace cli_test;

namespace {

std::string const small = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet ";

std::size_t count(std::string const& text, std::string const& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + part.size())) ++n;
  return n;
}

// The row of a table that begins with this cell.
std::string row(std::string const& page, std::string const& first) {
  auto const begin = page.find("<tr><td>" + first + "</td>");
  return begin == page.npos ? "" : page.substr(begin, page.find("</tr>", begin) - begin);
}

}  // namespace

TEST_CASE("compare puts scores, options, curves and views on one page") {
  folder const here;
  write_capture(here / "capture", 4, 3);
  REQUIRE(here.gart("train capture --out runs/short --iterations 4 --eval-every 2" + small).code == 0);
  REQUIRE(here.gart("train capture --out runs/long --iterations 30 --eval-every 10 --seed 7" + small).code == 0);
  auto const done = here.gart("compare runs/short runs/long/ --out pages/both.html");
  REQUIRE_MESSAGE(done.code == 0, done.err);
  CHECK(has(done.out, "pages/both.html"));
  auto const page = text_of(here / "pages/both.html");

  CHECK(has(page, "<h1>short, long</h1>"));
  char psnr[2][16];
  nlohmann::json metrics[2] = {here.json("runs/short/metrics.json"), here.json("runs/long/metrics.json")};
  for (int i = 0; i < 2; ++i) std::snprintf(psnr[i], sizeof psnr[i], "%.2f", metrics[i]["psnr"].get<double>());
  std::string const scores = row(page, "Test PSNR, dB");
  bool const long_is_better = metrics[1]["psnr"] > metrics[0]["psnr"];
  CHECK(has(scores, std::string(">") + (long_is_better ? psnr[0] : std::string("<b>") + psnr[0] + "</b>") + "<"));
  CHECK(has(scores, std::string(">") + (long_is_better ? std::string("<b>") + psnr[1] + "</b>" : psnr[1]) + "<"));

  CHECK(has(row(page, "--iterations"), ">4</td><td class=\"n\">30</td>"));
  CHECK(has(row(page, "--seed"), ">7</td>"));
  CHECK(row(page, "--max-gaussians").empty());  // the same in both

  // A line a run in each chart, and of each view a picture a run and the photograph.
  CHECK(count(page, "<polyline class=\"line-1\"") == count(page, "<polyline class=\"line-2\""));
  CHECK(has(page, "Test PSNR over training time"));
  CHECK(count(page, "<img ") == 9);
  // First the view on which the runs differ most.
  std::string widest;
  double most = -1;
  for (std::size_t i = 0; i < 3; ++i) {
    double const spread =
        std::abs(metrics[0]["views"][i]["psnr"].get<double>() - metrics[1]["views"][i]["psnr"].get<double>());
    if (spread > most) most = spread, widest = metrics[0]["views"][i]["name"].get<std::string>();
  }
  CHECK(page.find("<h3>") == page.find("<h3>" + widest + "</h3>"));
  CHECK_FALSE(has(page, "http"));

  // Runs of the same name are told apart by their folders.
  fs::create_directories(here / "other");
  fs::copy(here / "runs/long", here / "other/long", fs::copy_options::recursive);
  REQUIRE(here.gart("compare runs/long other/long --quiet").code == 0);
  auto const same = text_of(here / "compare.html");
  CHECK(has(same, "<h1>runs/long, other/long</h1>"));
  CHECK(has(same, "No option did."));
}

TEST_CASE("compare refuses what is no finished run, by name") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 2" + small).code == 0);
  fs::create_directories(here / "empty");
  auto const none = here.gart("compare run empty");
  CHECK(none.code == 1);
  CHECK_MESSAGE(has(none.err, "empty: is no folder of a finished training"), none.err);
  CHECK_FALSE(fs::exists(here / "compare.html"));
  auto const one = here.gart("compare run");
  CHECK(one.code == 2);
  CHECK_MESSAGE(has(one.err, "name two runs or more"), one.err);
  auto const twice = here.gart("compare run ./run");
  CHECK(twice.code == 1);
  CHECK_MESSAGE(has(twice.err, "run: is there twice"), twice.err);
  gart::write_file(here / "empty/metrics.json", "[1]");
  gart::write_file(here / "empty/config.json", "{}");
  auto const list = here.gart("compare run empty");
  CHECK(list.code == 1);
  CHECK_MESSAGE(has(list.err, "are no JSON objects"), list.err);
  gart::write_file(here / "empty/metrics.json",
                   R"({"views": [{"name": "../../x"}, 3], "psnr": "<b>", "scene": "<i>"})");
  auto const odd = here.gart("compare run empty");
  REQUIRE_MESSAGE(odd.code == 0, odd.err);
  auto const page = text_of(here / "compare.html");
  CHECK(has(page, "no test view in common"));
  CHECK_FALSE(has(page, "<i>&"));
}
