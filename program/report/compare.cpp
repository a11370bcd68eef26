#include "commands.hpp"
#include "compare_page.hpp"
#include "help.hpp"
#include "output.hpp"

#include <gart/io/file.hpp>

#include <cstdio>
#include <memory>

namespace gart_cli {

namespace {

struct compare_arguments {
  std::vector<std::filesystem::path> runs;
  std::filesystem::path out = "compare.html";
  bool quiet = false;
};

int run_compare(compare_arguments const& a) {
  if (a.runs.size() < 2) throw usage_error("RUN: name two runs or more");
  if (a.runs.size() > most_compared)
    throw usage_error("RUN: one page has room for " + std::to_string(most_compared) + " runs, and " +
                      std::to_string(a.runs.size()) + " are named");
  auto const runs = read_runs(a.runs);
  prepare_file(a.out);
  gart::write_file(a.out, compare_page(runs));
  if (!a.quiet) std::printf("page    %s\n", a.out.string().c_str());
  return 0;
}

}  // namespace

void add_compare(CLI::App& app, command& selected) {
  auto a = std::make_shared<compare_arguments>();
  CLI::App* compare = app.add_subcommand("compare", "One page of several trainings: scores, curves, options, views.");
  add_open(*compare, "RUN", a->runs, "", "Folders that gart train finished in, 2 to 6")->required();
  add_value(*compare, "--out", a->out, "FILE", "The page");
  add_quiet(*compare, a->quiet);
  compare->footer(
      "\nThe page needs no other file and no network. It shows the scores side by side, the options that "
      "differ, and curves over\nsteps and seconds. Test views that all runs have follow, the most different "
      "first.\n"
      "\nExamples:\n"
      "  gart train lego --out plain && gart train lego --out long --iterations 60000\n"
      "  gart compare plain long --out compare.html");
  compare->callback([a, &selected] { selected = [a] { return run_compare(*a); }; });
}

}  // namespace gart_cli
