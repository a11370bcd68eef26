// Which configurations there are, and which one a request means.
#include <gart/core/error.hpp>
#include <gart/runtime/degree_selection.hpp>
#include <gart/runtime/initial.hpp>
#include <gart/runtime/registry.hpp>

#include <algorithm>
#include <set>
#include <utility>

namespace gart {

namespace {

std::vector<compiled_configuration>& configurations() {
  static std::vector<compiled_configuration> all;
  return all;
}

bool matches(std::string const& wanted, std::string const& name) { return wanted == "auto" || wanted == name; }

// The window of the configuration that "auto" takes.
int usual_window(configuration_info const& of) {
  compiled_configuration const* best = nullptr;
  for (auto const& r : configurations())
    if (r.info.backend == of.backend && r.info.tracer == of.tracer && (!best || r.rank > best->rank)) best = &r;
  return best->info.window;
}

// What a configuration has that the ordinary one has not.
std::string peculiarities(configuration_info const& r) {
  std::string out;
  auto const add = [&out](std::string const& text) { out += ", " + text; };
  if (r.kernel_degree != 2) add("kernel degree " + std::to_string(r.kernel_degree));
  if (r.arithmetic != "exact") add(r.arithmetic + " arithmetic");
  if (r.lt_format != "none" && r.lt_format != "weight" && r.lt_format != "float4") add("LT format " + r.lt_format);
  if (r.tile_size != 8) add("tiles of " + std::to_string(r.tile_size));
  if (r.window != usual_window(r)) add("window " + std::to_string(r.window));
  return out;
}

// "openmp / tiles / primitive (SH 0 1 2 3)", configurations of one kind together.
std::string list_configurations() {
  std::vector<std::pair<std::string, std::set<int>>> kinds;
  for (auto const& r : configurations()) {
    std::string const kind = r.info.backend + " / " + r.info.tracer + " / " + r.info.backward + peculiarities(r.info);
    auto const same = std::find_if(kinds.begin(), kinds.end(), [&](auto const& k) { return k.first == kind; });
    (same == kinds.end() ? kinds.emplace_back(kind, std::set<int>{}) : *same).second.insert(r.info.sh_degree);
  }
  std::string out;
  for (auto const& [kind, degrees] : kinds) {
    out += (out.empty() ? "" : "; ") + kind + " (SH";
    for (int const d : degrees) out += " " + std::to_string(d);
    out += ")";
  }
  return out;
}

bool matches(configuration_request const& wanted, configuration_info const& there) {
  return matches(wanted.backend, there.backend) && matches(wanted.tracer, there.tracer) &&
         matches(wanted.backward, there.backward) && wanted.sh_degree == there.sh_degree &&
         wanted.kernel_degree == there.kernel_degree && wanted.arithmetic == there.arithmetic &&
         matches(wanted.lt_format, there.lt_format) && (wanted.tile_size == 0 || wanted.tile_size == there.tile_size) &&
         (wanted.window == 0 || wanted.window == there.window);
}

std::string as_text(configuration_request const& r) {
  std::string out = "backend " + r.backend + ", tracer " + r.tracer + ", backward " + r.backward + ", SH degree " +
                    std::to_string(r.sh_degree);
  if (r.kernel_degree != 2) out += ", kernel degree " + std::to_string(r.kernel_degree);
  if (r.arithmetic != "exact") out += ", " + r.arithmetic + " arithmetic";
  if (r.lt_format != "auto") out += ", LT format " + r.lt_format;
  if (r.tile_size != 0) out += ", tiles of " + std::to_string(r.tile_size);
  if (r.window != 0) out += ", window " + std::to_string(r.window);
  return out;
}

compiled_configuration const& find(configuration_request const& request) {
  compiled_configuration const* best = nullptr;
  std::string reason, unavailable;
  for (auto const& r : configurations()) {
    if (!matches(request, r.info)) continue;
    if (!r.available(&reason)) {
      unavailable = r.info.backend;
      continue;
    }
    if (!best || r.rank > best->rank) best = &r;
  }
  if (best) return *best;
  if (!unavailable.empty())
    throw unsupported("backend " + unavailable + ": " + reason +
                      "; use configuration_request.backend = openmp, which needs no device");
  throw unsupported("no compiled configuration for " + as_text(request) +
                    "; there are (backend / tracer / backward): " + list_configurations() +
                    ". A program compiles configurations of its own with GART_REGISTER_CONFIGURATIONS: "
                    "gart/runtime/compiled_configurations.hpp, shown by examples/5_own_configuration");
}

}  // namespace

void register_configuration(compiled_configuration const& entry) { configurations().push_back(entry); }

configuration_info resolve(configuration_request const& request) { return find(request).info; }

std::vector<configuration_info> compiled_configurations() {
  std::vector<configuration_info> out;
  for (auto const& r : configurations()) out.push_back(r.info);
  return out;
}

std::unique_ptr<renderer> make_renderer(configuration_request const& request) { return find(request).make_renderer(); }

std::unique_ptr<session> make_session(configuration_request const& request, train_options const& options,
                                      dataset const& data, gaussian_model const* start) {
  compiled_configuration const& found = find(request);
  trial_plan const plan = plan_trials(request, options, data.train.size());
  gaussian_model const from = start ? *start : initial_model(data, options);
  if (!plan.held_out.empty()) return make_degree_selection(request, options, data, from, plan);
  return found.make_session(options, data, from);
}

}  // namespace gart
