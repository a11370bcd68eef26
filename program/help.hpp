#pragma once
// How options look in --help ("--iterations N   Steps (default: 30000)"), and checks whose messages name the valid
// values.

#include <gart/core/words.hpp>
#include <gart/train/option_fields.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace gart_cli {

class help_formatter : public CLI::Formatter {
 public:
  help_formatter() { column_width(34); }
  // For a command with many options: --help shows the common ones, --help-all all and `more`.
  help_formatter(std::vector<std::string> common, std::string more)
      : common_(std::move(common)), more_(std::move(more)) {
    column_width(34);
  }
  std::string make_help(CLI::App const* app, std::string name, CLI::AppFormatMode mode) const override {
    all_ = common_.empty() || mode == CLI::AppFormatMode::All;
    std::string text = CLI::Formatter::make_help(app, name, mode);
    // What groups without a common option leave.
    for (std::size_t at; (at = text.find("\n\n\n")) != text.npos;) text.erase(at, 1);
    return text;
  }
  std::string make_group(std::string group, bool positional, std::vector<CLI::Option const*> options) const override {
    std::erase_if(options, [&](CLI::Option const* o) {
      return !all_ && !positional &&
             std::none_of(common_.begin(), common_.end(), [&](std::string const& name) { return o->check_name(name); });
    });
    return options.empty() ? "" : CLI::Formatter::make_group(group, positional, options);
  }
  std::string make_footer(CLI::App const* app) const override {
    return (common_.empty() ? ""
            : all_          ? more_
                            : "\nThe other options: --help-all\n") +
           CLI::Formatter::make_footer(app);
  }
  // "--auto, --no-auto": CLI11 would show what the second one sets.
  std::string make_option_name(CLI::Option const* option, bool positional) const override {
    std::string name = CLI::Formatter::make_option_name(option, positional);
    for (std::size_t at; (at = name.find("{false}")) != name.npos;) name.erase(at, 7);
    for (std::size_t at = 0; (at = name.find(",-", at)) != name.npos; ++at) name.replace(at, 1, ", ");
    return name;
  }
  std::string make_option_opts(CLI::Option const* option) const override {
    if (option->get_type_size() == 0) return "";
    return " " + option->get_type_name() + (option->get_required() ? " (required)" : "");
  }
  std::string make_option_desc(CLI::Option const* option) const override {
    std::string const value = option->get_default_str();
    return option->get_description() + (value.empty() ? "" : " (default: " + value + ")");
  }
  // The usage line names the files and folders in order; CLI11's own would put "[OPTIONS]" before them.
  std::string make_usage(CLI::App const* app, std::string name) const override {
    std::string usage = "\nUsage: " + (name.empty() ? app->get_name() : name);
    for (CLI::Option const* option : app->get_options([](CLI::Option const* o) { return o->get_positional(); })) {
      usage += option->get_required() ? " " + option->get_name(true) : " [" + option->get_name(true) + "]";
    }
    for (CLI::Option const* option : app->get_options([](CLI::Option const* o) { return o->get_required(); })) {
      if (!option->get_positional()) usage += " " + option->get_name() + " " + option->get_type_name();
    }
    return usage + (app->get_subcommands({}).empty() ? " [options]\n" : " COMMAND [options]\n");
  }

 private:
  std::vector<std::string> common_;
  std::string more_;
  mutable bool all_ = true;
};

// Refuses numbers that a whole number's option would not take: 1e3, 1.5. What is no number is left to other checks.
inline CLI::Validator in_whole_digits() {
  return CLI::Validator(
      [](std::string& text) {
        std::int64_t whole = 0;
        double value = 0;
        if (text.find_first_of(".eE") == text.npos || CLI::detail::lexical_cast(text, whole) ||
            !CLI::detail::lexical_cast(text, value))
          return std::string();
        std::string const refused = "'" + text + "' is not a whole number";
        bool const digits = value == std::floor(value) && std::abs(value) < 1e15;
        return digits ? refused + " in digits (write " + std::to_string(static_cast<long long>(value)) + ")" : refused;
      },
      "");
}

// An option with a value; `type` stands for it in the help: N, FILE. Left open it keeps what it has.
template <class T>
CLI::Option* add_open(CLI::App& app, std::string const& flag, T& value, std::string const& type,
                      std::string const& help) {
  CLI::Option* option = app.add_option(flag, value, help)->type_name(type);
  if constexpr (std::is_integral_v<T>) option->check(in_whole_digits());
  return option;
}
// One whose default the help shows.
template <class T>
CLI::Option* add_value(CLI::App& app, std::string const& flag, T& value, std::string const& type,
                       std::string const& help) {
  return add_open(app, flag, value, type, help)->capture_default_str();
}
inline void add_quiet(CLI::App& app, bool& quiet, std::string const& help = "Say nothing but errors") {
  app.add_flag("--quiet", quiet, help);
}

inline CLI::Validator one_of(std::vector<std::string> const& names) {
  return CLI::Validator(
      [names](std::string& value) {
        if (std::find(names.begin(), names.end(), value) != names.end()) return std::string();
        return "'" + value + "' is none of " + gart::joined(names);
      },
      "");
}

// A lower bound below a millionth says that the number must be above 0.
inline CLI::Validator between(double low, double high) {
  return CLI::Validator(
      [low, high](std::string& text) {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return std::string();
        auto const show = [](double v) {
          return v == std::floor(v) ? std::to_string(static_cast<long long>(v)) : gart::short_number(v);
        };
        return "'" + text + "' is not a number " +
               (low > 0 && low < 1e-6 ? "above 0, at most " : "from " + show(low) + " to ") + show(high);
      },
      "");
}

// Of 64 bits, in decimal digits: as a double it could lose some.
inline CLI::Validator whole_number() {
  return CLI::Validator(
      [](std::string& text) {
        std::uint64_t value = 0;
        auto const [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (code == std::errc() && end == text.data() + text.size()) return std::string();
        return "'" + text + "' is not a whole number from 0 to " + std::to_string(~std::uint64_t{0});
      },
      "");
}

}  // namespace gart_cli
