// What the program says of itself, and of command lines that are wrong.

#include "program.hpp"

#include <support/policies.hpp>

using namespace cli_test;

TEST_CASE("every command's help has a sentence, examples and defaults") {
  folder const here;
  for (std::string const command : {"train", "render", "view", "eval", "tradeoff", "synth", "info"}) {
    CAPTURE(command);
    auto const help = here.gart(command + " --help");
    CHECK(help.code == 0);
    CHECK(help.err.empty());
    CHECK(has(help.out, "Usage: gart " + command));
    CHECK(has(help.out, "rites"));
    auto const examples = help.out.find("Examples:\n");
    REQUIRE(examples != std::string::npos);
    auto const first = help.out.find("  gart " + command, examples);
    REQUIRE(first != std::string::npos);
    CHECK(help.out.find("  gart " + command, first + 1) != std::string::npos);
    if (command != "info") CHECK(has(help.out, "(default: "));
  }
}

TEST_CASE("train has every option that is promised, with its default") {
  folder const here;
  auto const help = here.gart("train --help-all").out;
  for (char const* option : {"--out DIR (required)",
                             "error.split.offset=0",
                             "--backend",
                             "--tracer",
                             "--backward",
                             "--iterations",
                             "--max-gaussians",
                             "--densify",
                             "--sh-degree",
                             "--auto, --no-auto ",
                             "(default: 3)",
                             "--downscale",
                             "--background",
                             "--alpha-min",
                             "--transmittance-min",
                             "--seed",
                             "--test-every",
                             "--eval-every",
                             "--resume",
                             "--quiet",
                             "--points",
                             "--start",
                             "--poses",
                             "--adam",
                             "--threads",
                             "(default: 30000)",
                             "(default: 0.0001)"}) {
    CAPTURE(option);
    CHECK(has(help, option));
  }
}

TEST_CASE("train --help is short, and --help-all has the rest") {
  folder const here;
  auto const brief = here.gart("train --help").out, all = here.gart("train --help-all").out;
  auto const options = [](std::string const& help) {
    int count = 0;
    for (std::size_t at = 0; (at = help.find("\n  --", at)) != help.npos; ++at) ++count;
    return count;
  };
  CHECK(options(brief) <= 20);
  CHECK(options(all) > 45);
  CHECK(has(brief, "--iterations"));
  CHECK_FALSE(has(brief, "--hit-memory"));
  CHECK(has(brief, "--help-all"));
}

TEST_CASE("wrong command lines exit with 2 and make nothing") {
  folder const here;
  struct line {
    char const *arguments, *says;
  };
  for (auto const& [arguments, says] : {
           line{"train x", "--out is required"},
           line{"train --out made", "DATASET is missing"},
           line{"train x --out made --iterations 0", "--iterations: '0' is not a number from 1"},
           line{"train x --out made --iterations ten", "--iterations"},
           line{"train x --out made --backend gpu", "'gpu' is none of auto, serial, openmp, cuda"},
           line{"train x --out made --densify all", "mcmc, adc, none"},
           line{"train x --out made --sh-degree 4", "--sh-degree"},
           line{"train x --out made --transmittance-min -1", "--transmittance-min"},
           line{"train x --out made --alpha-min nan", "--alpha-min"},
           line{"train x --out made --speed 9", "--speed"},
           line{"train x --out made --iteration 9", "; did you mean --iterations?"},
           line{"trian x --out made", "; did you mean train?"},
           line{"train x --out made --set rates.opactiy=1", "; did you mean rates.opacity?"},
           line{"train x --out made --set error.fill=0.3", "; it is error.growth_end now"},
           line{"train x --out made --set dropout=1", "a number from 0 to 0.999 belongs after dropout="},
           line{"train x --out made --seed -3", "--seed: '-3' is not a whole number from 0 to 18446744073709551615"},
           line{"train x --out made --max-gaussians 4294967296", "is not a number from 1 to 4294967295"},
           line{"train x --out made --gpus 0", "--gpus: '0' is not a number from 1 to 1024"},
           line{"train x --speed 9", "not understood: --speed; --out is required"},
           line{"eval --renders made model.ply x --otu made", "not understood: --otu; --out is required"},
           line{"synth --out made --seed -3", "--seed: '-3' is not a whole number"},
           line{"render model.ply --out made", "CAMERAS"},
           line{"render model.ply x --out made --background red", "black, white"},
           line{"eval model.ply x", "--out"},
           line{"paint", "paint"},
           line{"train x --out made --iterations 1e3",
                "--iterations: '1e3' is not a whole number in digits (write 1000)"},
           line{"train x --out made --iterations 1.5", "--iterations: '1.5' is not a whole number (see"},
           line{"train x --out made --iterations 5 --iterations 6", "--iterations: was given more than once (see"},
           line{"train x --out made --iterations", "--iterations: N is missing after it (see"},
           line{"train x --out made --kernel-degree 3", "--kernel-degree: '3' is none of 2"},
           line{"train x --out made --refine-lens --antialias", "with antialiasing (leave --antialias out)"},
           line{"train x --out made --refine-lens --set render.antialias=1", "(leave --set render.antialias out)"},
           line{"synth --out made --rolling 400", "--rolling: '400' is not a number from 0 to 90"},
           line{"mesh x x --out made --voxel -1", "--voxel: '-1' is not a number above 0, at most 1000000000 (see"},
           line{"render x x --out made --depth-unit 0", "--depth-unit: '0' is not a number above 0, at most"},
           line{"render x x --out made --alpha-min 0", "--alpha-min: '0' is not a number from 1e-06 to 0.99"},
       }) {
    CAPTURE(arguments);
    auto const result = here.gart(arguments);
    CHECK(result.code == 2);
    CHECK(result.out.empty());
    CHECK(has(result.err, "gart: error: "));
    CHECK(has(result.err, "--help"));
    CHECK_MESSAGE(has(result.err, says), result.err);
    CHECK_FALSE(fs::exists(here / "made"));
  }
  // No host has so many.
  auto const gpus = here.gart("train x --out made --gpus 1024");
  CHECK(gpus.code == 2);
  CHECK_MESSAGE(has(gpus.err, "--gpus 1024: this "), gpus.err);
  auto const bare = here.gart("");
  CHECK(bare.code == 2);
  CHECK(has(bare.err, "train"));
}

TEST_CASE("what only --help-all tells of is looked up there") {
  folder const here;
  for (auto const& [arguments, help] :
       {std::pair{"--set foo=1", "--set foo: no such field (see gart train --help-all)"},
        {"--depth-kind far", "auto, z, distance (see gart train --help-all)"},
        {"--hit-memry=3", "; did you mean --hit-memory? (see gart train --help-all)"},
        {"--speed", "(see gart train --help-all)"},
        {"--iterations 0", "(see gart train --help)"}}) {
    CAPTURE(arguments);
    auto const result = here.gart(std::string("train x --out made ") + arguments);
    CHECK(result.code == 2);
    CHECK_MESSAGE(has(result.err, help), result.err);
  }
  CHECK_FALSE(has(here.gart("train --help-all").out, "lists those"));
  for (char const* help : {"train --help", "train --help-all"}) CHECK_FALSE(has(here.gart(help).out, "{false}"));
}

TEST_CASE("values that are wrong whatever the files say exit with 2") {
  folder const here;
  write_capture(here / "capture");
  gart::write_splat_ply(here / "one.ply", one_gaussian());
  struct line {
    char const *arguments, *says;
  };
  for (auto const& [arguments, says] : {
           line{"render one.ply capture --out images --camera FOO", "--camera FOO: gart traces "},
           line{"render one.ply capture --out images --camera FISHEYE,angle=abc",
                "--camera FISHEYE,angle=abc: 'angle=abc' is not NAME=NUMBER"},
           line{"synth --out made --camera FOO", "--camera FOO: gart traces "},
           line{"synth --out made --origin 1,2", "--origin 1,2: is not three numbers (give X,Y,Z"},
           line{"mesh one.ply capture --out made.obj", "--out made.obj: gart mesh writes a PLY"},
           line{"mesh one.ply capture --out made", "a name that ends in .ply"},
           line{"convert one.ply made.obj", "made.obj: has the ending of no format of Gaussians that gart writes"},
           line{"convert one.ply made.ply --sh-bits 5,5", "--sh-bits: PLY has nothing of the kind (write a .spz"},
           line{"convert one.ply made.glb --sh-bits 5,5", "or a .glb with --spz"},
           line{"convert one.ply made.spz --palette 64", "--palette: SPZ has nothing of the kind (write a .sog"},
           line{"convert one.ply made.ply --spz", "--spz: PLY has nothing of the kind (write a .glb"},
           line{"convert one.ply made.spz --world", "--world: SPZ has nothing of the kind (write a .ply or a .glb"},
           line{"convert one.ply made.ply --crop 1,1,1,2,-1,2",
                "its corners are swapped, y goes from 1 to -1 (give the least corner first)"},
       }) {
    CAPTURE(arguments);
    auto const result = here.gart(arguments);
    CHECK(result.code == 2);
    CHECK_MESSAGE(has(result.err, says), result.err);
    for (char const* name : {"made", "made.ply", "made.spz", "made.glb", "made.obj"})
      CHECK_FALSE(fs::exists(here / name));
  }
}

TEST_CASE("a rule that turns the filter off is no antialiasing") {
  folder const here;
  auto const run = here.gart("train nowhere --out made --refine-lens --set render.antialias=0");
  CHECK(run.code == 1);
  CHECK_MESSAGE(has(run.err, "nowhere: there is no such file"), run.err);
}

TEST_CASE("convert says the degree that it wrote") {
  folder const here;
  auto model = one_gaussian();
  model.sh_degree = 1, model.sh.resize(12, 0.1f);
  gart::write_splat_ply(here / "one.ply", model);
  auto const done = here.gart("convert one.ply one.splat");
  REQUIRE_MESSAGE(done.code == 0, done.err);
  CHECK_MESSAGE(has(done.out, "1 of 1 Gaussians, SH degree 0, "), done.out);
  CHECK(has(here.gart("convert one.ply same.ply").out, "SH degree 1, "));
}

TEST_CASE("bench --quiet prints the table alone") {
  folder const here;
  write_capture(here / "capture");
  gart::write_splat_ply(here / "one.ply", one_gaussian());
  std::string const bench = "bench one.ply capture --backend serial --warmups 0 --repeats 1 --quiet";
  auto const one = here.gart(bench + " --views 1");
  REQUIRE_MESSAGE(one.code == 0, one.err);
  CHECK(one.err.empty());
  CHECK_MESSAGE(has(one.out, "medians of 1, of one view\n"), one.out);
  CHECK(has(here.gart(bench + " --views 2").out, "mean over 2 views\n"));
  CHECK(has(here.gart("bench --help").out, "Print the table of results alone"));
}

TEST_CASE("rules are set by name and kept; unknown ones are refused") {
  folder const here;
  write_capture(here / "capture");
  std::string const run = "train capture --backend serial --iterations 2 --max-gaussians 20 --quiet --out ";
  REQUIRE(here.gart(run + "plain").code == 0);
  auto const set = here.gart(run + "set --set rates.mean=0,rates.mean_final=0,rates.log_scale=0");
  CHECK_MESSAGE(set.code == 0, set.err);
  CHECK(here.json("set/config.json")["options"]["set"] ==
        nlohmann::json{{"rates.mean", 0.0}, {"rates.mean_final", 0.0}, {"rates.log_scale", 0.0}});
  CHECK(text_of(here / "set/model.ply") != text_of(here / "plain/model.ply"));
  auto const unknown = here.gart(run + "none --set rates.speed=1");
  CHECK(unknown.code == 2);
  CHECK_MESSAGE(has(unknown.err, "--set rates.speed: no such field (see "), unknown.err);
  auto const own = here.gart(run + "none --set iterations=5");
  CHECK(own.code == 2);
  CHECK_MESSAGE(has(own.err, "--set iterations: has an option of its own, --iterations"), own.err);
  auto const fraction = here.gart(run + "none --set error.every=0.9");
  CHECK(fraction.code == 2);
  CHECK_MESSAGE(has(fraction.err, "a whole number belongs after error.every="), fraction.err);
  auto const text = here.gart(run + "none --set near=far");
  CHECK(text.code == 2);
  CHECK_MESSAGE(has(text.err, "a finite number belongs after near="), text.err);
}

TEST_CASE("output that cannot be written is a failure") {
  folder const here;
  if (!fs::exists("/dev/full")) return;
  for (std::string const command : {"info", "--help", "train --help", "--version"}) {
    CAPTURE(command);
    std::string const line = "'" GART_PROGRAM "' " + command + " >/dev/full 2>'" + (here / "said").string() + "'";
    int const status = std::system(line.c_str());
    CHECK(WEXITSTATUS(status) == 1);
    CHECK(has(text_of(here / "said"), "standard output cannot be written"));
  }
}

TEST_CASE("info names the version and the configurations") {
  folder const here;
  auto const info = here.gart("info");
  CHECK(info.code == 0);
  CHECK(has(info.out, "gart       "));
  // These tests are not optimised, the libraries may be.
  std::string const set = gart::instruction_set;
  CHECK(has(info.out, "compiled for " + set.substr(0, set.find("_unoptimised"))));
  CHECK(has(info.out, "serial   bvh     pixel"));
  CHECK(has(info.out, "openmp   bvh     pixel"));
  CHECK(has(info.out, "auto means "));
  auto const tried = here.gart("info --self-test");
  CHECK_MESSAGE(tried.code == 0, tried.out);
  CHECK(has(tried.out, "configurations agree with the definition, 0 do not"));
}
