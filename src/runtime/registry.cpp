// Which configurations there are, and which one a request means.
#include <gart/core/error.hpp>
#include <gart/core/words.hpp>
#include <gart/runtime/registry.hpp>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

namespace gart {

namespace {

std::vector<compiled_configuration>& configurations() {
  static std::vector<compiled_configuration> all;
  return all;
}

template <class E>
bool matches(E wanted, E there) {
  return wanted == E::automatic || wanted == there;
}

// What a request asks of a configuration: a part of it, as messages name it, whether it is met, and what is there.
struct asked {
  char const* name;
  bool (*met)(configuration_request const&, configuration_info const&);
  std::string (*there)(configuration_info const&);
};

using want = configuration_request const&;
using have = configuration_info const&;

asked const parts[] = {
    {"backend", [](want w, have t) { return matches(w.backend, t.backend); },
     [](have t) { return std::string(to_string(t.backend)); }},
    {"tracer", [](want w, have t) { return matches(w.tracer, t.tracer); },
     [](have t) { return std::string(to_string(t.tracer)); }},
    {"backward", [](want w, have t) { return w.backward == "auto" || w.backward == t.backward; },
     [](have t) { return t.backward; }},
    {"SH degree", [](want w, have t) { return w.sh_degree >= 0 && w.sh_degree <= t.stored_degree; },
     [](have t) { return "to " + std::to_string(t.stored_degree); }},
    {"kernel degree", [](want w, have t) { return w.kernel_degree == t.kernel_degree; },
     [](have t) { return std::to_string(t.kernel_degree); }},
    {"hit format", [](want w, have t) { return matches(w.hit_format, t.hit_format); },
     [](have t) { return std::string(to_string(t.hit_format)); }},
    {"depth", [](want w, have t) { return w.depth == t.depth; },
     [](have t) { return std::string(t.depth ? "with depth" : "without depth"); }},
    {"number of ranks", [](want w, have t) { return (w.ranks != nullptr) == t.ranks; },
     [](have t) { return std::string(t.ranks ? "several" : "one"); }},
    {"device", [](want w, have t) { return (w.device == 0 && !w.stream) || t.backend == backend_kind::cuda; },
     [](have t) { return std::string(t.backend == backend_kind::cuda ? "those of cuda" : "0, without a stream"); }},
};

// All parts are met, or all but one.
bool matches(want wanted, have there, asked const* but = nullptr) {
  return std::all_of(std::begin(parts), std::end(parts),
                     [&](asked const& part) { return &part == but || part.met(wanted, there); });
}

// ": ruled out by its tracer (others: bvh, tiles)", by each part that alone stands in the way.
std::string ruled_out_by(configuration_request const& wanted) {
  std::string out;
  for (asked const& part : parts) {
    std::set<std::string> there;
    for (auto const& r : configurations())
      if (matches(wanted, r.info, &part)) there.insert(part.there(r.info));
    if (!there.empty())
      out += (out.empty() ? ": ruled out by its " : " or by its ") + std::string(part.name) +
             " (others: " + joined(there) + ")";
  }
  return out;
}

std::string as_text(configuration_request const& r) {
  std::string out = std::string("backend ") + to_string(r.backend) + ", tracer " + to_string(r.tracer) + ", backward " +
                    r.backward + ", SH degree " + std::to_string(r.sh_degree);
  if (r.kernel_degree != 2) out += ", kernel degree " + std::to_string(r.kernel_degree);
  if (r.hit_format != hit_format_kind::automatic) out += std::string(", hit format ") + to_string(r.hit_format);
  if (r.depth) out += ", with depth";
  if (r.ranks) out += ", on several ranks";
  if (r.device != 0) out += ", device " + std::to_string(r.device);
  if (r.stream) out += ", a CUDA stream of the caller's";
  return out;
}

}  // namespace

compiled_configuration const& find_configuration(configuration_request const& request) {
  compiled_configuration const* best = nullptr;
  std::string reason, unavailable;
  for (auto const& r : configurations()) {
    if (!matches(request, r.info) || (best && r.rank < best->rank)) continue;
    if (!r.available(&reason)) {
      unavailable = to_string(r.info.backend);
      continue;
    }
    // Of two that are alike, the one that stores less.
    bool const stores_less = best && r.rank == best->rank && r.info.stored_degree < best->info.stored_degree;
    if (!best || r.rank > best->rank || stores_less) best = &r;
  }
  if (best) return *best;
  auto const built = [](auto const& is) {
    return std::any_of(configurations().begin(), configurations().end(), [&](auto const& r) { return is(r.info); });
  };
  bool const by_optix = request.tracer == tracer_kind::optix;
  if (!unavailable.empty())
    throw unsupported("backend " + unavailable + ": " + reason +
                      (by_optix ? "; use configuration_request.tracer = bvh, which gives the same image"
                                : "; use configuration_request.backend = openmp, which needs no device"));
  if (request.backend == backend_kind::cuda && !built([](have t) { return t.backend == backend_kind::cuda; }))
    throw unsupported(
        "backend cuda: this gart was built without CUDA: use configuration_request.backend = openmp, which needs no "
        "device, or configure gart with -DGART_CUDA=ON");
  if (by_optix && !built([](have t) { return t.tracer == tracer_kind::optix; }))
    throw unsupported(
        "tracer optix is not in this build: configure gart with -DGART_OPTIX=ON -DOptiX_ROOT=FOLDER, NVIDIA's OptiX "
        "SDK, or use configuration_request.tracer = bvh, which gives the same image");
  throw unsupported("no compiled configuration for " + as_text(request) + ruled_out_by(request) +
                    "; gart info lists all, and GART_REGISTER_CONFIGURATIONS compiles others "
                    "(examples/5_own_configuration)");
}

void require_shared(shared_model const* model, configuration_info const& own, int device) {
  if (!model) throw invalid_argument("renderer.share_model: the shared model is null: make_shared_model makes one");
  configuration_request const& its = model->request();
  auto const require = [](bool same, char const* what, std::string const& one, std::string const& other) {
    if (!same)
      throw invalid_argument(std::string("renderer.share_model: the shared model is of ") + what + " " + one +
                             ", and the renderer of " + other +
                             ": make both by the same backend, device and degrees of configuration_request");
  };
  require(its.backend == own.backend, "backend", to_string(its.backend), to_string(own.backend));
  require(its.device == device, "device", std::to_string(its.device), std::to_string(device));
  require(its.sh_degree == own.sh_degree, "SH degree", std::to_string(its.sh_degree), std::to_string(own.sh_degree));
  require(its.kernel_degree == own.kernel_degree, "kernel degree", std::to_string(its.kernel_degree),
          std::to_string(own.kernel_degree));
  require(model->compiled_for() == own.instruction_set, "instruction set", model->compiled_for(), own.instruction_set);
}

void register_configuration(compiled_configuration const& entry) { configurations().push_back(entry); }

configuration_info resolve(configuration_request const& request) {
  configuration_info found = find_configuration(request).info;
  found.sh_degree = request.sh_degree;
  return found;
}

std::vector<configuration_info> compiled_configurations() {
  std::vector<configuration_info> out;
  for (auto const& r : configurations()) out.push_back(r.info);
  return out;
}

}  // namespace gart
