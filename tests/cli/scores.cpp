// What train and eval score, beside test PSNR and SSIM: training views, the best affine colour, PSNR over seconds, and
// the pairs of images for other programs. And that a test photograph is looked at for its score alone.

#include "program.hpp"

#include <support/policies.hpp>

#include <scores.hpp>

#include <algorithm>
#include <limits>
#include <vector>

using namespace cli_test;

namespace {

std::string const small = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet ";

double psnr_of_files(fs::path const& render, fs::path const& truth) {
  auto const a = gart::read_image(render), b = gart::read_image(truth);
  REQUIRE(a.data.size() == b.data.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow((a.data[i] - b.data[i]) / 255.0, 2);
  return -10 * std::log10(sum / static_cast<double>(a.data.size()));
}

std::vector<std::string> files_in(fs::path const& folder) {
  std::vector<std::string> names;
  for (auto const& file : fs::directory_iterator(folder)) names.push_back(file.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

TEST_CASE("train and eval score the same training views, evenly spread") {
  folder const here;
  write_capture(here / "capture", 6, 2);
  REQUIRE(here.gart("train capture --out run --iterations 40" + small).code == 0);
  auto const metrics = here.json("run/metrics.json");
  auto const& training = metrics["training_scores"];
  CHECK(metrics["test_views"] == 2);
  CHECK(metrics["train_views"] == 6);
  CHECK(training["scored_views"] == 2);
  REQUIRE(training["views"].size() == 2);
  REQUIRE(here.gart("render run/model.ply capture --out images --backend serial --quiet").code == 0);
  int at = 0;
  for (auto const& view : training["views"]) {
    auto const name = view["name"].get<std::string>();
    CHECK(has(name, at++ == 0 ? "v1" : "v4"));
    CHECK(psnr_of_files(here / ("images/" + name + ".png"),
                        here / ("capture/train/" + name.substr(name.find('v')) + ".png")) ==
          doctest::Approx(view["psnr"].get<double>()).epsilon(0.005));
  }
  CHECK(training["psnr"].get<double>() ==
        doctest::Approx((training["views"][0]["psnr"].get<double>() + training["views"][1]["psnr"].get<double>()) / 2));
  auto const page = text_of(here / "run/report.html");
  CHECK(has(page, "Training, 2 of 6, evenly spread"));
  CHECK(has(page, "a diagnostic, not a score"));
  CHECK(has(page, "<b>Gaussians</b><span class=\"key\">" + metrics["gaussians"].dump() + "</span>"));

  auto const eval = here.gart("eval run/model.ply capture --out scores.json --backend serial");
  REQUIRE_MESSAGE(eval.code == 0, eval.err);
  CHECK(has(eval.out, "over 2 of 6 views"));
  CHECK(has(eval.out, "a diagnostic"));
  auto const scores = here.json("scores.json");
  for (char const* key : {"psnr", "ssim", "psnr_affine_colour"}) {
    CAPTURE(key);
    CHECK(scores[key].get<double>() == doctest::Approx(metrics[key].get<double>()).epsilon(1e-6));
    CHECK(scores["training_scores"][key].get<double>() == doctest::Approx(training[key].get<double>()).epsilon(1e-6));
  }
}

TEST_CASE("a score that there is not goes unsaid") {
  gart::scores test;
  test.views.resize(1), test.psnr = 20, test.ssim = 0.5;
  test.affine_psnr = std::numeric_limits<double>::quiet_NaN();
  CHECK(gart_cli::in_words(test, {}, 6) == "test PSNR 20.00 dB, SSIM 0.5000 over 1 view\n");
  test.affine_psnr = 21;
  CHECK(has(gart_cli::in_words(test, {}, 6), "over 1 view; after the best affine colour of each 21.00 dB"));
}

TEST_CASE("affine colour forgives an exposure, PSNR does not") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 40 --test-every 0" + small).code == 0);
  REQUIRE(here.gart("eval run/model.ply capture --out plain.json --backend serial --quiet").code == 0);
  for (std::string const name : {"v0", "v1"}) {
    auto photo = gart::read_image(here / ("capture/test/" + name + ".png"));
    for (auto& v : photo.data) v = static_cast<gart::u8>(std::lround(0.5 * v + 110));
    gart::write_png(here / ("capture/test/" + name + ".png"), photo);
  }
  REQUIRE(here.gart("eval run/model.ply capture --out dim.json --backend serial --quiet --background black").code == 0);
  auto const plain = here.json("plain.json"), dim = here.json("dim.json");
  CHECK(dim["psnr"].get<double>() < plain["psnr"].get<double>() - 1);
  // Half of the colours, half of what is left: 6 dB more, were it not for clamping and 8 bits.
  CHECK(dim["psnr_affine_colour"].get<double>() > plain["psnr_affine_colour"].get<double>() + 5);
  for (auto const& scores : {plain, dim})
    for (auto const& view : scores["views"]) CHECK(view["psnr_affine_colour"] >= view["psnr"]);
}

TEST_CASE("PSNR over seconds is complete over a stop and in old files") {
  folder const here;
  write_capture(here / "capture");
  std::string const run = "train capture --out run --iterations 30 --eval-every 10 --stop-at 21";
  REQUIRE(here.gart(run + small).code == 130);
  auto history = here.json("run/history.json");
  double const first = history["test"][0][3], last = history["train"].back()[1];
  CHECK(first > 0);
  CHECK(first < last);
  for (auto& row : history["test"]) row.erase(3);
  gart::write_file(here / "run/history.json", history.dump());
  REQUIRE(here.gart("train --resume --out run --quiet").code == 0);
  auto const metrics = here.json("run/metrics.json");
  auto const& points = metrics["psnr_over_seconds"]["test"];
  REQUIRE(points.size() == 3);
  CHECK(metrics["psnr_over_seconds"]["test_columns"][0] == "seconds");
  CHECK(points[0][0].get<double>() == doctest::Approx(first));
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(points[i][1] == 10 * static_cast<int>(i + 1));
    if (i) CHECK(points[i][0] > points[i - 1][0]);
  }
  CHECK(points[2][0] == metrics["seconds"]);
  CHECK(points[2][2] == metrics["psnr"]);
  CHECK(metrics["psnr_over_seconds"]["train"].size() == 30);
  CHECK(has(text_of(here / "run/report.html"), "PSNR over training time"));
}

TEST_CASE("eval scores pairs of images by names alone") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 5" + small).code == 0);
  std::string const eval = "eval run/model.ply capture --out scores.json --pairs pairs --backend serial --quiet";
  REQUIRE(here.gart(eval).code == 0);
  auto const names = files_in(here / "pairs/render");
  CHECK(names.size() == 2);
  CHECK(names == files_in(here / "pairs/truth"));
  for (auto const& name : names) {
    auto const stem = name.substr(0, name.size() - 4);
    CHECK(text_of(here / ("pairs/render/" + name)) == text_of(here / ("run/renders/" + name)));
    CHECK(text_of(here / ("pairs/truth/" + name)) == text_of(here / ("run/renders/" + stem + "_truth.png")));
  }
  REQUIRE(here.gart(eval).code == 0);  // over its own
  gart::write_file(here / "pairs/truth/older.png", "");
  auto const refused = here.gart(eval);
  CHECK(refused.code == 1);
  CHECK_MESSAGE(has(refused.err, "pairs/truth/older.png: is no test view"), refused.err);
}

TEST_CASE("test photographs change no exposure, model or render") {
  folder const here;
  write_capture(here / "capture");
  write_capture(here / "other");
  for (int i = 0; i < 2; ++i) {
    fs::path const file = here / ("other/test/v" + std::to_string(i) + ".png");
    auto photo = gart::read_image(file);
    for (std::size_t p = 0; p < photo.data.size(); ++p)
      photo.data[p] = static_cast<gart::u8>(40 + photo.data[p] / (p % 3 + 2));
    gart::write_png(file, photo);
  }
  std::string const options = " --iterations 60 --eval-every 20 --exposure on --background black" + small;
  for (std::string const name : {"capture", "other"}) {
    REQUIRE(here.gart("train " + name + " --out run_" + name + options).code == 0);
    REQUIRE(here.gart("eval run_" + name + "/model.ply " + name + " --out " + name + ".json --pairs pairs_" + name +
                      " --exposures run_" + name + "/exposures.json --background black --quiet --backend serial")
                .code == 0);
  }
  CHECK(here.json("run_capture/metrics.json")["psnr"] != here.json("run_other/metrics.json")["psnr"]);
  for (char const* file : {"model.ply", "exposures.json"})
    CHECK(text_of(here / ("run_capture/" + std::string(file))) == text_of(here / ("run_other/" + std::string(file))));
  auto const names = files_in(here / "pairs_capture/render");
  REQUIRE(names.size() == 2);
  for (auto const& name : names) {
    CHECK(text_of(here / ("run_capture/renders/" + name)) == text_of(here / ("run_other/renders/" + name)));
    CHECK(text_of(here / ("pairs_capture/render/" + name)) == text_of(here / ("pairs_other/render/" + name)));
  }
}
