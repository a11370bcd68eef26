// The library's errors name fields; the program shows its options instead.

#include "program.hpp"

#include <field_names.hpp>
#include <train/train_fields.hpp>

#include <support/policies.hpp>

using namespace cli_test;

TEST_CASE("a message names options where the library names fields") {
  using gart_cli::in_options;
  CHECK(
      in_options(
          "lower train_options.max_gaussians, raise dataset_options.downscale, or use configuration_request.backward = "
          "hybrid") == "lower --max-gaussians, raise --downscale, or use --backward hybrid");
  CHECK(in_options("(configuration_request.tracer = tiles or bvh)") == "(--tracer tiles or bvh)");
  CHECK(in_options("render_options.transmittance_min") == "--transmittance-min");
  // A field at the end of a sentence, and a value that is not this field's.
  CHECK(in_options("raise dataset_options.downscale. = 3") == "raise --downscale. = 3");
  // What the command has not is an option of gart train.
  auto const has_none = [](std::string const& option) { return option != "--downscale"; };
  CHECK(in_options("use train_options.seed = 4, raise dataset_options.downscale = 2.", has_none) ==
        "use --seed 4, raise gart train --downscale 2.");
  CHECK(in_options("(near is render_options.near, dataset_options.downscale)", has_none) ==
        "(near is near, gart train --downscale)");
  // What only looks like a field, in a path for one, stays.
  for (std::string const text : {"", "...", "my_train_options.seed", "train_options.seeds", "train_options.seed.png",
                                 "train_options", "a = b"}) {
    CAPTURE(text);
    CHECK(in_options(text) == text);
  }
}

TEST_CASE("options that fields are shown as belong to train or view") {
  folder const here;
  std::string const help = here.gart("train --help-all").out + here.gart("view --help").out;
  for (auto const& [field, option] : gart_cli::field_names()) {
    CAPTURE(field);
    // "--set NAME" is of the option --set.
    std::string const shown(option.substr(0, option.find(' ')));
    if (shown.substr(0, 2) == "--") CHECK_MESSAGE(has(help, "  " + shown), option);
  }
  for (gart::option_field const& field : gart::option_fields) {
    std::string const flag = gart_cli::flag_of(field), name(field.name);
    CAPTURE(name);
    CHECK(has(help, flag.empty() ? "  " + name + "=" : "  " + flag));
    CHECK(gart_cli::option_of("train_options." + name) == (flag.empty() ? "--set " + name : flag));
  }
}

TEST_CASE("settings are recorded as numbers and read from older text") {
  using gart_cli::field_values;
  auto const values = field_values::of_text("rates.mean=0,error.growth_end=0.25");
  gart::train_options options;
  values.apply(options);
  CHECK(options.rates.mean == 0);
  CHECK(options.error.growth_end == 0.25f);
  CHECK(values.has("rates.mean"));
  CHECK_FALSE(values.has("near"));
  CHECK(values.json() == nlohmann::json{{"rates.mean", 0.0}, {"error.growth_end", 0.25}});
  CHECK(field_values::of_json(values.json()).json() == values.json());
  CHECK(field_values::of_json("").json().empty());
  CHECK(field_values::of_json("error.fill=0.3,rates.settled=0.2").json() ==
        nlohmann::json{{"error.growth_end", 0.3}, {"rates.final_scale", 0.2}});
  for (nlohmann::json const& wrong :
       {nlohmann::json(3), nlohmann::json(), nlohmann::json::array(), nlohmann::json{{"near", "x"}},
        nlohmann::json{{"nope", 1}}, nlohmann::json{{"dropout", 5}}}) {
    CAPTURE(wrong.dump());
    CHECK_THROWS_AS(field_values::of_json(wrong), gart::error);
  }
  for (double const value : {0.1, 0.005, 1e5, 0.999, 4294967295.0, 1e-6})
    CHECK(std::stod(gart::short_number(value)) == value);
  CHECK(gart::short_number(static_cast<double>(0.06f)) == "0.06");
  CHECK(gart::short_number(100000) == "100000");
}

TEST_CASE("the user of the program reads of options") {
  folder const here;
  gart::write_splat_ply(here / "model.ply", one_gaussian());
  gart::write_file(here / "large.json",
                   R"([{"name": "a", "width": 70000, "height": 4, "fx": 4, "fy": 4, "cx": 2, "cy": 2,
                        "c2w": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}])");
  auto const large = here.gart("render model.ply large.json --out made --backend serial --quiet");
  CHECK(large.code == 1);
  CHECK_MESSAGE(has(large.err, "or raise --downscale)"), large.err);
  CHECK_FALSE(has(large.err, "_options."));

  write_capture(here / "capture");
  std::string const run = "train capture --out run --iterations 2 --backend serial --quiet --max-gaussians 60";
  REQUIRE(here.gart(run).code == 0);
  gart::write_file(here / "run/checkpoint.gart", "cut");
  auto const resumed = here.gart("train --resume --out run");
  CHECK(resumed.code == 1);
  CHECK_MESSAGE(has(resumed.err, "without --resume the run starts anew"), resumed.err);
}
