// What a run does with the folder that it writes to: whose files it replaces, who else may write there, what is left
// when the disk is full, and how a run that was over goes on.

#include "program.hpp"

#include <support/policies.hpp>

#include <fcntl.h>
#include <sys/file.h>

using namespace cli_test;

namespace {

std::string const small = " --backend serial --max-gaussians 60 --sh-degree 1 --quiet ";

}  // namespace

TEST_CASE("a run that replaces another leaves nothing of it") {
  folder const here;
  write_capture(here / "many", 4, 5);
  write_capture(here / "few", 4, 2);
  REQUIRE(here.gart("train many --out run --iterations 4 --exposure on" + small).code == 0);
  CHECK(std::distance(fs::directory_iterator(here / "run/renders"), fs::directory_iterator()) == 10);
  gart::write_file(here / "run/renders/notes.txt", "mine");
  gart::write_file(here / "run/notes.txt", "mine");

  REQUIRE(here.gart("train few --out run --iterations 8 --stop-at 4 --exposure off" + small).code == 130);
  std::vector<std::string> left;
  for (auto const& file : fs::recursive_directory_iterator(here / "run"))
    left.push_back(file.path().filename().string());
  std::sort(left.begin(), left.end());
  CHECK(left == std::vector<std::string>{"checkpoint.gart", "config.json", "history.json", "model.ply", "notes.txt",
                                         "notes.txt", "renders"});
  // An image that came there since is none of the run's either.
  gart::write_file(here / "run/renders/old.png", "");
  REQUIRE(here.gart("train --resume --out run --quiet").code == 0);
  CHECK_FALSE(fs::exists(here / "run/renders/old.png"));
  CHECK(std::distance(fs::directory_iterator(here / "run/renders"), fs::directory_iterator()) == 5);
}

TEST_CASE("files that no run left are refused and kept") {
  folder const here;
  write_capture(here / "capture");
  for (std::string const name : {"model.ply", "config.json", "metrics.json", "renders/a.png"}) {
    CAPTURE(name);
    fs::remove_all(here / "run");
    fs::create_directories(here / "run/renders");
    gart::write_file(here / ("run/" + name), "{}");
    auto const run = here.gart("train capture --out run --iterations 2" + small);
    CHECK(run.code == 1);
    CHECK_MESSAGE(has(run.err, "run/" + name + ": is there, from no run of gart train"), run.err);
    CHECK(has(run.err, "choose another --out, or move it away"));
    CHECK(text_of(here / ("run/" + name)) == "{}");
    CHECK_FALSE(fs::exists(here / "run/checkpoint.gart"));
  }
  // An empty folder of images is nobody's.
  fs::remove_all(here / "run");
  fs::create_directories(here / "run/renders");
  REQUIRE(here.gart("train capture --out run --iterations 2" + small).code == 0);
  auto const own = here.gart("train capture --out run --start run/model.ply --iterations 2" + small);
  CHECK(own.code == 2);
  CHECK_MESSAGE(has(own.err, "is the model in --out"), own.err);
  CHECK(fs::exists(here / "run/model.ply"));
}

TEST_CASE("an image that cannot be written is named, and the run fails") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 2" + small).code == 0);
  std::string const name = here.json("run/metrics.json")["views"].back()["name"].get<std::string>() + ".png";
  fs::create_directories(here / ("views/" + name));  // where the last picture belongs
  for (std::string const command :
       {"eval run/model.ply capture --out scores.json --renders views", "render run/model.ply capture --out views"}) {
    CAPTURE(command);
    auto const run = here.gart(command + " --backend serial");
    CHECK(run.code == 1);
    CHECK_MESSAGE(has(run.err, "views/" + name), run.err);
    CHECK(fs::is_directory(here / ("views/" + name)));
  }
  CHECK_FALSE(fs::exists(here / "scores.json"));
}

TEST_CASE("one program at a time writes to a folder") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 8 --stop-at 4" + small).code == 130);
  CHECK_FALSE(fs::exists(here / "run/.gart.lock"));
  // Held as the program holds it.
  int const held = open((here / "run/.gart.lock").c_str(), O_RDWR | O_CREAT, 0666);
  REQUIRE(flock(held, LOCK_EX) == 0);
  REQUIRE(write(held, "4711", 4) == 4);
  auto const before = text_of(here / "run/checkpoint.gart");
  for (std::string const command : {"train --resume --out run", "train capture --out run"}) {
    CAPTURE(command);
    auto const second = here.gart(command);
    CHECK(second.code == 1);
    CHECK_MESSAGE(has(second.err, "run: another gart train (process 4711) is writing there"), second.err);
  }
  CHECK(text_of(here / "run/checkpoint.gart") == before);
  close(held);
  // A file without a lock is what a program that died left.
  CHECK(here.gart("train --resume --out run --quiet").code == 0);
  CHECK_FALSE(fs::exists(here / "run/.gart.lock"));

  // And by the program itself: one that runs on while the other tries.
  gart::write_file(
      here / "both.sh",
      "gart='" GART_PROGRAM
      "'\n"
      "$gart train capture --out run --iterations 100000000 --backend serial --densify none 2>first.txt &\n"
      "first=$!\n"
      "for i in $(seq 600); do grep -q it/s first.txt && break; sleep 0.1; done\n"
      "$gart train capture --out run --iterations 2 2>second.txt\n"
      "echo $? >>second.txt\n"
      "kill -TERM $first\n"
      "wait $first\n");
  CHECK(WEXITSTATUS(std::system(("cd '" + (here / ".").string() + "' && sh both.sh >both.txt 2>&1").c_str())) == 130);
  CHECK_MESSAGE(has(text_of(here / "second.txt"), "another gart train (process "), text_of(here / "second.txt"));
  CHECK(has(text_of(here / "second.txt"), "\n1\n"));
}

TEST_CASE("where the disk is full at the end the model is there") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 8 --stop-at 4" + small).code == 130);
  auto const before = text_of(here / "run/checkpoint.gart");
  auto const model = text_of(here / "run/model.ply");
  REQUIRE(model.size() + 2000 < before.size());
  // Files may be as large as the model, but not as the checkpoint.
  auto const blocks = std::to_string((model.size() + 1000) / 512);
  auto const run = here.gart("train --resume --out run", "trap '' XFSZ; ulimit -f " + blocks + "; ");
  CHECK(run.code == 1);
  CHECK_MESSAGE(has(run.err, "checkpoint.gart: cannot be written"), run.err);
  CHECK(has(run.err, "the model is whole: run/model.ply"));
  CHECK(text_of(here / "run/checkpoint.gart") == before);
  CHECK(text_of(here / "run/model.ply") != model);
  CHECK(gart::read_splat_ply(here / "run/model.ply").size() == 40);
}

TEST_CASE("a finished run continues where iterations are raised") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 10" + small).code == 0);
  auto const longer = here.gart("train --resume --out run --iterations 25 --stop-at 20");
  CHECK(longer.code == 130);
  CHECK_MESSAGE(has(longer.err, "resuming after step 10\n"), longer.err);
  CHECK_MESSAGE(has(longer.err, "--iterations 25 instead of 10: rates, degrees and densification follow"), longer.err);
  for (char const* name : {"metrics.json", "report.html", "renders/test_v0.png"})
    CHECK_FALSE(fs::exists(here / ("run/" + std::string(name))));
  REQUIRE(here.gart("train --resume --out run --quiet").code == 0);
  auto const metrics = here.json("run/metrics.json"), config = here.json("run/config.json");
  CHECK(metrics["iterations"] == 25);
  CHECK(config["options"]["iterations"] == 25);
  REQUIRE(metrics["raised"].size() == 1);
  CHECK(metrics["raised"][0] == nlohmann::json({{"option", "iterations"}, {"step", 10}, {"from", 10}, {"to", 25}}));
  CHECK(here.json("run/history.json")["train"].back()[0] == 25);
}

TEST_CASE("a log that nobody reads any more costs no result") {
  folder const here;
  write_capture(here / "capture");
  std::string const run = "cd '" + (here / ".").string() + "' && '" GART_PROGRAM "' train capture --out run" +
                          " --iterations 60 --backend serial --max-gaussians 60 2>&1 | head -c 1 >/dev/null";
  REQUIRE(std::system(run.c_str()) == 0);
  CHECK(fs::exists(here / "run/metrics.json"));
  CHECK(fs::exists(here / "run/report.html"));
}

TEST_CASE("a folder that cannot be made is refused before anything is read") {
  folder const here;
  gart::write_file(here / "file", "x");
  auto const below = here.gart("train nowhere --out file/run");
  CHECK(below.code == 1);
  CHECK_MESSAGE(has(below.err, "file/run: cannot be made a folder"), below.err);
  auto const good = here.gart("train nowhere --out deep/run");
  CHECK_MESSAGE(has(good.err, "nowhere"), good.err);
  CHECK_FALSE(fs::exists(here / "deep"));
  CHECK(here.gart("train nowhere --out ''").code == 2);
}

TEST_CASE("Ctrl-C during trials ends the run, and leaves nothing") {
  folder const here;
  write_capture(here / "capture", 16);
  auto const run = here.gart_interrupted_at("measuring", "train capture --out run --backend serial --max-gaussians 60");
  CHECK(run.code == 130);
  CHECK_MESSAGE(has(run.err, "Stopped before the first step"), run.err);
  CHECK_FALSE(fs::exists(here / "run"));
}

TEST_CASE("a time budget ends the run and survives a stop") {
  folder const here;
  write_capture(here / "capture");
  std::string const run = "train capture --iterations 100000000 --time-budget 2 --backend serial --max-gaussians 60";
  REQUIRE(here.gart(run + " --out run --quiet --stop-at 20").code == 130);
  CHECK(here.json("run/config.json")["options"]["time-budget"] == 2);
  auto const resumed = here.gart("train --resume --out run");
  REQUIRE_MESSAGE(resumed.code == 0, resumed.err);
  CHECK_FALSE(has(resumed.err, "/100,000,000"));
  auto const metrics = here.json("run/metrics.json");
  CHECK(metrics["time_budget"] == 2);
  double const seconds = metrics["seconds"];
  CHECK(seconds > 1.8);  // a last step that would not fit is left out
  int const steps = metrics["iterations"];
  CHECK(steps > 20);
  CHECK(steps < 100000000);
  auto const& tests = metrics["psnr_over_seconds"]["test"];
  REQUIRE(tests.size() >= 2);  // five where no step takes a fifth of the time
  CHECK(tests.size() <= 5);
  CHECK(tests[0][0].get<double>() >= 0.4);
  CHECK(tests.back()[1] == steps);
  CHECK(metrics["psnr_over_seconds"]["train"].size() <= 203);

  auto const on = here.gart("train --resume --out run --time-budget 3");
  REQUIRE_MESSAGE(on.code == 0, on.err);
  CHECK(has(on.err, "--time-budget 3.0 instead of 2.0"));
  CHECK(here.json("run/metrics.json")["seconds"].get<double>() > 2.7);
  CHECK(here.json("run/metrics.json")["iterations"].get<int>() > steps);
  CHECK(here.json("run/metrics.json")["raised"][0]["step"] == steps);
  auto const lifted = here.gart("train --resume --out run --stop-at 1 --time-budget 0");
  CHECK_MESSAGE(has(lifted.err, "--time-budget 0.0 instead of 3.0"), lifted.err);
  auto const limited = here.gart("train --resume --out run --time-budget 9");
  CHECK(limited.code == 2);
  CHECK_MESSAGE(has(limited.err, "can only be raised"), limited.err);
}

TEST_CASE("a run with a time budget that was killed early can be resumed") {
  folder const here;
  write_capture(here / "capture");
  std::string const run = "train capture --iterations 100000000 --time-budget 1000 --backend serial --max-gaussians 60";
  CHECK(here.gart_interrupted_at(" it/s", run + " --out run --eval-every 0", SIGKILL).code != 0);
  auto const resumed = here.gart("train --resume --out run --stop-at 1");
  CHECK_MESSAGE(resumed.code == 130, resumed.err);
}

TEST_CASE("a time budget that steps do not come to changes no bit") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out with --iterations 150 --time-budget 100000" + small).code == 0);
  REQUIRE(here.gart("train capture --out without --iterations 150" + small).code == 0);
  CHECK(text_of(here / "with/model.ply") == text_of(here / "without/model.ply"));
  CHECK(here.json("with/metrics.json")["iterations"] == 150);
}
