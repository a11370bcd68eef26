// Which rows there are, and which one a request means.
#include <gart/core/error.hpp>
#include <gart/runtime/degree_selection.hpp>
#include <gart/runtime/initial.hpp>
#include <gart/runtime/rows.hpp>

#include <algorithm>
#include <set>
#include <utility>

namespace gart {

namespace {

std::vector<compiled_row>& rows() {
  static std::vector<compiled_row> all;
  return all;
}

bool matches(std::string const& wanted, std::string const& name) { return wanted == "auto" || wanted == name; }

// The window of the row that "auto" takes.
int usual_window(row_info const& row) {
  compiled_row const* best = nullptr;
  for (auto const& r : rows())
    if (r.row.backend == row.backend && r.row.tracer == row.tracer && (!best || r.rank > best->rank)) best = &r;
  return best->row.window;
}

// What a row has that the ordinary one has not.
std::string peculiarities(row_info const& r) {
  std::string out;
  auto const add = [&out](std::string const& text) { out += ", " + text; };
  if (r.kernel_degree != 2) add("kernel degree " + std::to_string(r.kernel_degree));
  if (r.arithmetic != "exact") add(r.arithmetic + " arithmetic");
  if (r.lt_format != "none" && r.lt_format != "weight" && r.lt_format != "float4") add("LT format " + r.lt_format);
  if (r.tile_size != 8) add("tiles of " + std::to_string(r.tile_size));
  if (r.window != usual_window(r)) add("window " + std::to_string(r.window));
  return out;
}

// "openmp / tiles / primitive (SH 0 1 2 3)", rows of one kind together.
std::string list_rows() {
  std::vector<std::pair<std::string, std::set<int>>> kinds;
  for (auto const& r : rows()) {
    std::string const kind = r.row.backend + " / " + r.row.tracer + " / " + r.row.backward + peculiarities(r.row);
    auto const same = std::find_if(kinds.begin(), kinds.end(), [&](auto const& k) { return k.first == kind; });
    (same == kinds.end() ? kinds.emplace_back(kind, std::set<int>{}) : *same).second.insert(r.row.sh_degree);
  }
  std::string out;
  for (auto const& [kind, degrees] : kinds) {
    out += (out.empty() ? "" : "; ") + kind + " (SH";
    for (int const d : degrees) out += " " + std::to_string(d);
    out += ")";
  }
  return out;
}

bool matches(row_request const& wanted, row_info const& row) {
  return matches(wanted.backend, row.backend) && matches(wanted.tracer, row.tracer) &&
         matches(wanted.backward, row.backward) && wanted.sh_degree == row.sh_degree &&
         wanted.kernel_degree == row.kernel_degree && wanted.arithmetic == row.arithmetic &&
         matches(wanted.lt_format, row.lt_format) && (wanted.tile_size == 0 || wanted.tile_size == row.tile_size) &&
         (wanted.window == 0 || wanted.window == row.window);
}

std::string as_text(row_request const& r) {
  std::string out = "backend " + r.backend + ", tracer " + r.tracer + ", backward " + r.backward + ", SH degree " +
                    std::to_string(r.sh_degree);
  if (r.kernel_degree != 2) out += ", kernel degree " + std::to_string(r.kernel_degree);
  if (r.arithmetic != "exact") out += ", " + r.arithmetic + " arithmetic";
  if (r.lt_format != "auto") out += ", LT format " + r.lt_format;
  if (r.tile_size != 0) out += ", tiles of " + std::to_string(r.tile_size);
  if (r.window != 0) out += ", window " + std::to_string(r.window);
  return out;
}

compiled_row const& find(row_request const& request) {
  compiled_row const* best = nullptr;
  std::string reason, unavailable;
  for (auto const& r : rows()) {
    if (!matches(request, r.row)) continue;
    if (!r.available(&reason)) {
      unavailable = r.row.backend;
      continue;
    }
    if (!best || r.rank > best->rank) best = &r;
  }
  if (best) return *best;
  if (!unavailable.empty())
    throw unsupported("backend " + unavailable + ": " + reason +
                      "; use row_request.backend = openmp, which needs no device");
  throw unsupported(
      "no compiled row for " + as_text(request) + "; there are (backend / tracer / backward): " + list_rows() +
      ". A program compiles rows of its own with GART_REGISTER_ROWS: gart/runtime/compiled_rows.hpp, shown "
      "by examples/5_own_row");
}

}  // namespace

void register_row(compiled_row const& row) { rows().push_back(row); }

row_info resolve(row_request const& request) { return find(request).row; }

std::vector<row_info> compiled_rows() {
  std::vector<row_info> out;
  for (auto const& r : rows()) out.push_back(r.row);
  return out;
}

std::unique_ptr<renderer> make_renderer(row_request const& request) { return find(request).make_renderer(); }

std::unique_ptr<session> make_session(row_request const& request, train_options const& options, dataset const& data,
                                      gaussian_model const* start) {
  compiled_row const& row = find(request);
  trial_plan const plan = plan_trials(request, options, data.train.size());
  gaussian_model const from = start ? *start : initial_model(data, options);
  if (!plan.held_out.empty()) return make_degree_selection(request, options, data, from, plan);
  return row.make_session(options, data, from);
}

}  // namespace gart
