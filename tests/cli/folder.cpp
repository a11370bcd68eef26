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

TEST_CASE("files of a run's names that no run left are refused, and left as they are") {
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

TEST_CASE("a run that was over goes on where iterations are raised, and says that it did") {
  folder const here;
  write_capture(here / "capture");
  REQUIRE(here.gart("train capture --out run --iterations 10" + small).code == 0);
  auto const longer = here.gart("train --resume --out run --iterations 25 --stop-at 20");
  CHECK(longer.code == 130);
  CHECK_MESSAGE(has(longer.err, "resuming after step 10\n"), longer.err);
  CHECK_MESSAGE(has(longer.err, "of 25 iterations instead of 10: rates, degrees and densification follow"), longer.err);
  for (char const* name : {"metrics.json", "report.html", "renders/test_v0.png"})
    CHECK_FALSE(fs::exists(here / ("run/" + std::string(name))));
  REQUIRE(here.gart("train --resume --out run --quiet").code == 0);
  auto const metrics = here.json("run/metrics.json"), config = here.json("run/config.json");
  CHECK(metrics["iterations"] == 25);
  CHECK(config["options"]["iterations"] == 25);
  REQUIRE(metrics["iterations_raised"].size() == 1);
  CHECK(metrics["iterations_raised"][0] == nlohmann::json({{"step", 10}, {"from", 10}, {"to", 25}}));
  CHECK(here.json("run/history.json")["train"].back()[0] == 25);
}
