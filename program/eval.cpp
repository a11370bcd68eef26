#include "choices.hpp"
#include "commands.hpp"
#include "image_writer.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "ranks.hpp"
#include "scores.hpp"

#include <gart/io/dataset.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/image_file.hpp>

#include <cstdio>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct eval_arguments {
  fs::path model, dataset, out, renders, pairs, exposures;
  configuration_options configuration;
  photo_options photos;
  std::string background = "auto";
  int downscale = 1, test_every = 8;
  std::string test_split = "nth";
  int max_hits = -1;
  bool quiet = false;
};

// A program that scores a folder against another takes all that is in them.
void refuse_other_images(fs::path const& pairs, std::vector<gart::dataset_view> const& views) {
  std::set<std::string> ours;
  for (auto const& v : views) ours.insert(v.name + ".png");
  for (char const* side : {"render", "truth"}) {
    for (auto const& file : fs::directory_iterator(pairs / side)) {
      if (ours.count(file.path().filename().string()) == 0)
        throw gart::io_error(file.path().string(), "is no test view of this capture, and would be scored with them",
                             "remove it, or name another folder");
    }
  }
}

// This rank's share.
gart::some_views dealt(gart::some_views const& views) {
  gart::some_views mine;
  for (std::size_t i = 0; i < views.size(); ++i)
    if (ranks::takes(i)) mine.push_back(views[i]);
  return mine;
}

// The scores of all ranks' views, in the order in which they were dealt out.
void put_together(gart::scores& of, std::size_t count) {
  using json = nlohmann::json;
  if (ranks::size() == 1) return;
  json mine = json::array();
  for (gart::view_score const& v : of.views)
    mine.push_back({v.name, v.psnr, v.ssim, v.affine_psnr, v.own_psnr, v.captured_psnr, v.milliseconds});
  std::string bytes;
  json::to_cbor(mine, bytes);
  std::vector<json> parts;
  for (std::string const& part : ranks::gathered(bytes)) parts.push_back(json::from_cbor(part));
  of.views.clear();
  for (std::size_t i = 0; i < count; ++i) {
    json const& v = parts[i % parts.size()][i / parts.size()];
    of.views.push_back({v[0], v[1], v[2], v[3], v[4], v[5], v[6]});
  }
  gart::take_means(of);
}

int run_eval(eval_arguments const& a) {
  if (ranks::built) ranks::start(false);
  bool const speaks = ranks::rank() == 0;
  gart::model_file file = gart::load_model(a.model);
  auto const renderer = gart::make_renderer(configuration_request_for(file, a.model, a.configuration.request()));
  if (speaks) prepare_file(a.out);
  if (!a.renders.empty()) prepare_folder(a.renders);
  for (char const* side : {"render", "truth"})
    if (!a.pairs.empty()) prepare_folder(a.pairs / side);
  gart::dataset_options load;
  load.downscale = a.downscale;
  load.test_every = a.test_every;
  load.test_split = gart::from_string<gart::split_kind>(a.test_split);
  a.photos.set(load);
  load.host = ranks::on_host();
  load.origin = file.origin;
  gart::dataset const data = gart::load_dataset(a.dataset, load);
  if (data.test.empty()) {
    throw gart::io_error(a.dataset.string(), "has no test views (" + data.split + ")",
                         "--test-every 8 keeps each 8th view");
  }
  if (!a.pairs.empty()) refuse_other_images(a.pairs, data.test);
  std::string const background = a.background != "auto" ? a.background : background_for(gart::inspect(data)).value;
  gart::render_options options = file.render;
  options.background = background_color(background);
  if (a.max_hits >= 0) options.max_hits = static_cast<gart::u32>(a.max_hits);
  renderer->set_model(file.model);

  gart::exposure_field const exposures =
      a.exposures.empty() ? gart::exposure_field() : gart::read_exposures(a.exposures, file.origin);

  fs::path const beside = a.model.parent_path() / "exposures.json";
  if (a.exposures.empty() && fs::exists(beside) && speaks && !a.quiet)
    std::printf("scored in the scene's own colours: for those of photographs --exposures %s\n",
                beside.string().c_str());

  progress say(a.quiet || !speaks);
  say.notes(file.notes);
  auto const draw = [&](gart::camera const& view) { return renderer->render(view, options); };
  gart::some_views const tests = dealt(gart::all_of(data.test));
  image_writer files;
  gart::scores result = gart::evaluate(
      tests, options.background, exposures, draw,
      [&](std::size_t i, gart::view_score const& s, gart::image_float const& render, gart::image_float const& truth) {
        if (!a.renders.empty()) {
          files.png(a.renders / (s.name + ".png"), gart::to_8bit(render));
          files.png(a.renders / (s.name + "_truth.png"), gart::to_8bit(truth));
        }
        if (!a.pairs.empty()) {
          files.png(a.pairs / "render" / (s.name + ".png"), gart::to_8bit(render));
          files.png(a.pairs / "truth" / (s.name + ".png"), gart::to_8bit(truth));
        }
        say.state("scored " + std::to_string(i + 1) + "/" + std::to_string(tests.size()) + "  " + s.name + " " +
                      fixed(s.psnr, 2) + " dB",
                  static_cast<double>(i + 1) / static_cast<double>(tests.size()));
      });
  put_together(result, data.test.size());
  say.state("scoring training views", 1);
  gart::some_views const spread = gart::evenly_spread(data.train, data.test.size());
  gart::scores training = gart::evaluate(dealt(spread), options.background, exposures, draw);
  put_together(training, spread.size());
  files.finish();
  gart::u64 const most_bytes = ranks::largest(renderer->peak_bytes());
  if (!speaks) return 0;
  auto const configuration = renderer->configuration();
  nlohmann::json metrics = to_json(result, training, data.train.size());
  metrics["format"] = data.format, metrics["split"] = data.split, metrics["resize_filter"] = data.resize_filter;
  metrics["background"] = background, metrics["notes"] = data.notes;
  metrics["gaussians"] = file.model.size(), metrics["sh_degree"] = file.model.sh_degree;
  metrics["kernel_degree"] = file.kernel_degree;
  metrics["backend"] = gart::to_string(configuration.backend),
  metrics["tracer"] = gart::to_string(configuration.tracer);
  metrics["approximations"] = approximations_of(options, configuration);
  metrics["peak_bytes"] = most_bytes;
  write_json(a.out, metrics);
  say.clear();
  if (!a.quiet) {
    std::printf("%s%s; %s background\n", in_words(result, training, data.train.size()).c_str(), data.split.c_str(),
                background.c_str());
  }
  return 0;
}

}  // namespace

void add_eval(CLI::App& app, command& selected) {
  auto a = std::make_shared<eval_arguments>();
  CLI::App* eval = app.add_subcommand("eval", "Score a model against the test views of a capture: PSNR and SSIM.");
  add_model(*eval, a->model)->required();
  add_open(*eval, "DATASET", a->dataset, "", "The capture, as gart train reads it")->required();
  add_open(*eval, "--out", a->out, "METRICS.json", "Where the scores go")->required();
  add_open(*eval, "--renders", a->renders, "DIR", "Also keep NAME.png and NAME_truth.png of each view here");
  add_open(*eval, "--pairs", a->pairs, "DIR",
           "Also keep DIR/render/NAME.png and DIR/truth/NAME.png of each\nview, for LPIPS (bench/perceptual.py) and "
           "what else compares\ntwo folders");
  add_exposures(*eval, a->exposures);
  add_value(*eval, "--background", a->background, "NAME", "white or black; auto: as gart train chooses")
      ->check(one_of({"auto", "white", "black"}));
  add_photo_options(*eval, a->photos);
  add_downscale(*eval, a->downscale);
  add_value(*eval, "--test-every", a->test_every, "N", "Each Nth view is for testing, where the capture does not say")
      ->check(between(1, 1e6));
  add_value(*eval, "--test-split", a->test_split, "NAME",
            "Which views are for testing: nth or sector (see gart train --help-all)")
      ->check(name_of_a<gart::split_kind>());
  add_max_hits(*eval, a->max_hits);
  add_quiet(*eval, a->quiet);
  add_configuration_options(*eval, a->configuration);
  eval->footer(
      "\nWrites METRICS.json: psnr (dB) and ssim, their means over the test views and each view's, and how they were "
      "taken.\npsnr_affine_colour is a diagnostic, no score: PSNR after the affine colour that brings each render "
      "nearest to its\nphotograph. training_scores are those of training views, evenly spread, as many as there are "
      "test "
      "views at most.\n"
      "\nExamples:\n"
      "  gart eval run/model.ply lego --out metrics.json\n"
      "  gart eval other.ply garden --downscale 4 --out scores.json --renders images");
  eval->callback([a, &selected] { selected = [a] { return run_eval(*a); }; });
}

}  // namespace gart_cli
