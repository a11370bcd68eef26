#pragma once
// The commands of the `gart` program. Each add_* adds one subcommand with its options and help to the app. When the
// user names the subcommand, it sets `selected`. main runs that after it has parsed the whole command line. So no
// command starts work on a line with a mistake.
//
//   void add_thing(CLI::App& app, command& selected) {
//     auto options = std::make_shared<thing_options>();
//     CLI::App* thing = app.add_subcommand("thing", "One sentence: what it does.");
//     thing->add_option("--out", options->out, "Folder for the thing")->required();
//     thing->footer("Writes ...\n\nExamples:\n  gart thing --out here\n");
//     thing->callback([options, &selected] { selected = [options] { return run_thing(*options); }; });
//   }
//
// A command returns the program's exit code: 0, or exit_interrupted. It fails by throwing: gart::error and its kin exit
// with 1, usage_error with 2; main prints "gart: error: ...".

#include <gart/core/error.hpp>

#include <CLI/CLI.hpp>

#include <functional>

namespace gart_cli {

using command = std::function<int()>;

inline constexpr int exit_failed = 1;
inline constexpr int exit_usage = 2;
inline constexpr int exit_interrupted = 130;  // the exit code that shells report for a program that Ctrl-C ended

// A command line whose options contradict each other or the files on disk.
struct usage_error : gart::error {
  using gart::error::error;
};

void add_train(CLI::App& app, command& selected);
void add_render(CLI::App& app, command& selected);
void add_view(CLI::App& app, command& selected);
void add_eval(CLI::App& app, command& selected);
void add_synth(CLI::App& app, command& selected);
void add_bench(CLI::App& app, command& selected);
void add_tradeoff(CLI::App& app, command& selected);
void add_compare(CLI::App& app, command& selected);
void add_convert(CLI::App& app, command& selected);
void add_mesh(CLI::App& app, command& selected);
void add_info(CLI::App& app, command& selected);

}  // namespace gart_cli
