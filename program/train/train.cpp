#include "commands.hpp"
#include "train_arguments.hpp"
#include "train_fields.hpp"
#include "training_run.hpp"

#include <memory>

namespace gart_cli {

void add_train(CLI::App& app, command& selected) {
  auto a = std::make_shared<train_arguments>();
  CLI::App* train = app.add_subcommand(
      "train", "Train Gaussians on the photographs of a capture, test them on held-out views, and report.");
  add_arguments(*train, *a);
  train->set_help_all_flag("--help-all", "Print every option and rule, and exit");
  train->formatter(std::make_shared<help_formatter>(
      std::vector<std::string>{"--help", "--help-all", "--out", "--resume", "--quiet", "--iterations",
                               "--max-gaussians", "--sh-degree", "--auto", "--seed", "--exposure", "--refine-poses",
                               "--downscale", "--background", "--test-every", "--backend", "--preset", "--view"},
      fields_in_help()));
  train->footer(
      "\nWrites into DIR:\n"
      "  model.ply         the Gaussians, as other viewers read them\n"
      "  exposures.json    with --exposure: of each training view, with --vignetting: of each lens,\n"
      "                    for gart render and gart eval\n"
      "  poses.json        with --refine-poses or --refine-lens: the training views' cameras as learned, for\n"
      "                    gart render and --poses;\n"
      "  poses_test.json   and the test views', aligned to their photographs where poses are learned\n"
      "  report.html       one page: scores, curves, test views with their errors, where time and memory went\n"
      "  metrics.json      the same in figures\n"
      "  renders/          each test view: NAME.png, and NAME_truth.png beside it\n"
      "  checkpoint.gart   all that the next step depends on; with config.json and history.json what --resume needs\n"
      "A run that was in DIR before is replaced, all of it; files of these names that no run left there are not.\n"
      "Ctrl-C, SIGTERM or SIGHUP finishes the step, saves, and exits with 130. Before the first step nothing is "
      "saved.\n"
      "\nExamples:\n"
      "  gart train lego --out run --downscale 4 --iterations 2000 --max-gaussians 20000\n"
      "  gart train --resume --out run");
  train->callback([a, train, &selected] {
    fill_in(*train, *a);
    selected = [a] {
      train_options_of(*a);  // reports a wrong setting before anything is read
      return training_run(*a).run();
    };
  });
}

}  // namespace gart_cli
