// The `gart` program: trains, renders and scores scenes of ray-traced 3D Gaussians from the command line.

#include "commands.hpp"
#include "field_names.hpp"
#include "help.hpp"
#include "printable.hpp"
#include "ranks.hpp"
#include "threads.hpp"

#include <gart/core/version.hpp>
#include <gart/core/words.hpp>

#include <cctype>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <string>
#include <vector>

namespace {

// What CLI11 met on the line and could not place. It reports missing options first, without these.
std::string not_understood(CLI::App const& app) {
  std::string words;
  for (std::string const& word : app.remaining(true))
    if (word.size() > 1 && word[0] == '-') words += (words.empty() ? "" : " ") + word;
  return words.empty() ? words : "not understood: " + words + "; ";
}

// The options and commands that these are near to.
std::string suggested(CLI::App const& app) {
  CLI::App const* of = &app;
  for (CLI::App const* sub : app.get_subcommands()) of = sub;
  std::vector<std::string> names;
  for (CLI::Option const* o : of->get_options()) names.push_back(o->get_name());
  for (CLI::App const* sub : of->get_subcommands({})) names.push_back(sub->get_name());
  std::string words;
  for (std::string const& word : app.remaining(true))
    words += gart::did_you_mean(word.substr(0, word.find('=')), names);
  return words;
}

bool stands_in(std::string const& text, std::string const& name) {
  for (std::size_t at = 0; (at = text.find(name, at)) != text.npos; at += name.size())
    if (char const next = (text + " ")[at + name.size()]; next != '-' && !std::isalnum(next)) return true;
  return false;
}

// The help that tells of the options in a message: all of it, where the short one leaves one of them out.
std::string help_for(CLI::App const& command, std::string const& message) {
  if (!command.get_help_all_ptr()) return "--help";
  std::string const brief = command.help();
  for (CLI::Option const* o : command.get_options({}))
    if (stands_in(message, o->get_name()) && !stands_in(brief, "\n  " + o->get_name())) return "--help-all";
  return "--help";
}

// What CLI11 says of an option, in plain words.
std::string in_plain_words(CLI::ParseError const& e) {
  std::string const said = e.what();
  if (std::size_t const at = said.find(": At Most 1 required but received "); at != said.npos)
    return said.substr(0, at) + ": was given more than once";
  if (std::size_t const at = said.find(": 1 required "); at != said.npos && said.ends_with(" missing"))
    return said.substr(0, at) + ": " + said.substr(at + 13, said.size() - at - 21) + " is missing after it";
  std::string const odd = "Could not convert: ";
  if (std::size_t const equals = said.find(" = "); said.starts_with(odd) && equals != said.npos)
    return said.substr(odd.size(), equals - odd.size()) + ": '" + said.substr(equals + 3) +
           "' is no value that belongs there";
  return said;
}

// Output that did not reach its end is no success.
int flushed(int code) {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return code;
  std::fprintf(stderr, "gart: error: standard output cannot be written (free some space, or name another place)\n");
  return code == 0 ? gart_cli::exit_failed : code;
}

// One rank's error is the end of all: the others would wait for it.
int fail(std::string const& what, int code) {
  gart_cli::ranks::wait_to_speak();
  std::fprintf(stderr, "gart: error: %s%s\n", gart_cli::ranks::name().c_str(), gart_cli::printable(what).c_str());
  if (gart_cli::ranks::size() > 1) std::fflush(stderr), gart_cli::ranks::end_all(code);
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace gart_cli;
  bound_threads(argv);
  CLI::App app{"gart trains and renders scenes of ray-traced 3D Gaussians.", "gart"};
  app.formatter(std::make_shared<help_formatter>());
  app.set_version_flag("--version", std::string("gart ") + gart::version, "Print the version and leave");
  app.require_subcommand(0, 1);
  app.footer(
      "\nExamples:\n"
      "  gart synth --out capture                 a small capture to try things on\n"
      "  gart train capture --out run             train on it; run/report.html shows how it went\n"
      "  gart train --help-all                    every option of a command\n"
      "\nExit codes: 0 done, 1 failed, 2 the command line is wrong, 130 stopped by Ctrl-C, SIGTERM or SIGHUP (train: "
      "saved, "
      "resumable; view: 0).");
  command selected;
  add_train(app, selected);
  add_render(app, selected);
  add_view(app, selected);
  add_eval(app, selected);
  add_bench(app, selected);
  add_tradeoff(app, selected);
  add_compare(app, selected);
  add_synth(app, selected);
  add_convert(app, selected);
  add_mesh(app, selected);
  add_info(app, selected);

  try {
    app.parse(argc, argv);
  } catch (CLI::ParseError const& e) {
    if (ranks::launched_rank() > 0) return e.get_exit_code() == 0 ? 0 : exit_usage;  // rank 0 says it
    if (e.get_exit_code() == 0) return flushed(app.exit(e));
    std::string topic = "gart ";
    CLI::App const* of = &app;
    for (CLI::App const* sub : app.get_subcommands()) topic += sub->get_name() + " ", of = sub;
    std::string const odd = dynamic_cast<CLI::RequiredError const*>(&e) ? not_understood(app) : std::string();
    std::string const what = odd + in_plain_words(e) + suggested(app);
    bool const unknown = dynamic_cast<CLI::ExtrasError const*>(&e) && of->get_help_all_ptr();
    return fail(what + " (see " + topic + (unknown ? "--help-all" : help_for(*of, what)) + ")", exit_usage);
  }
  if (!selected) {
    std::fputs(app.help().c_str(), stderr);
    return exit_usage;
  }
  // Commands that have nothing to share out are rank 0's.
  bool const shares =
      ranks::built && (app.got_subcommand("render") || app.got_subcommand("eval") || app.got_subcommand("info"));
  if (ranks::launched_rank() > 0 && !shares && !app.got_subcommand("train")) return 0;
  CLI::App const& command_app = *app.get_subcommands().front();
  auto const has_option = [&](std::string const& option) { return command_app.get_option_no_throw(option) != nullptr; };
  try {
    if (app.got_subcommand("train"))
      ranks::launch_on(app.get_subcommand("train")->get_option("--gpus")->as<int>(), argv);
    return flushed(selected());
  } catch (usage_error const& e) {
    return fail(e.what(), exit_usage);
  } catch (std::bad_alloc const&) {
    return fail("out of host memory (" +
                    in_options("lower train_options.max_gaussians, or raise dataset_options.downscale", has_option) +
                    ")",
                exit_failed);
  } catch (std::exception const& e) {
    return fail(in_options(e.what(), has_option), exit_failed);
  }
}
