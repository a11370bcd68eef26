// Which rows there are, and which one a request means.
#include <gart/core/error.hpp>
#include <gart/train/degree_selection.hpp>
#include <gart/train/initial.hpp>
#include <gart/train/rows.hpp>

#include <algorithm>

namespace gart {

namespace {

std::vector<compiled_row>& rows() {
  static std::vector<compiled_row> all;
  return all;
}

bool matches(std::string const& wanted, std::string const& name) { return wanted == "auto" || wanted == name; }

std::string list_rows() {
  std::vector<std::string> names;
  for (auto const& r : rows()) {
    std::string const name = r.row.backend + " / " + r.row.tracer + " / " + r.row.backward;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  std::string out;
  for (auto const& name : names) out += (out.empty() ? "" : ", ") + name;
  return out;
}

compiled_row const& find(row_request const& request) {
  compiled_row const* best = nullptr;
  std::string reason, unavailable;
  for (auto const& r : rows()) {
    if (!matches(request.backend, r.row.backend) || !matches(request.tracer, r.row.tracer) ||
        !matches(request.backward, r.row.backward) || request.sh_degree != r.row.sh_degree)
      continue;
    if (!r.available(&reason)) {
      unavailable = r.row.backend;
      continue;
    }
    if (!best || r.rank > best->rank) best = &r;
  }
  if (best) return *best;
  if (!unavailable.empty())
    throw unsupported("backend " + unavailable + ": " + reason + "; use --backend openmp, which needs no device");
  throw unsupported("no compiled row for backend " + request.backend + ", tracer " + request.tracer + ", backward " +
                    request.backward + ", SH degree " + std::to_string(request.sh_degree) +
                    "; there are, with SH degrees 0 to 3 (backend / tracer / backward): " + list_rows());
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
