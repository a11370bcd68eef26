// Which configurations there are, and which one a request means.
#include <gart/core/error.hpp>
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

template <class E>
bool matches(E wanted, E there) {
  return wanted == E::automatic || wanted == there;
}

// The words that tell a configuration from the ordinary one.
std::string peculiarities(configuration_info const& r) {
  std::string out;
  auto const add = [&out](std::string const& text) { out += ", " + text; };
  if (r.kernel_degree != 2) add("kernel degree " + std::to_string(r.kernel_degree));
  using enum hit_format_kind;
  if (r.hit_format != none && r.hit_format != weight && r.hit_format != float4)
    add(std::string("hit format ") + to_string(r.hit_format));
  if (r.depth) add("with depth");
  if (r.ranks) add("on several ranks");
  return out;
}

// "openmp / tiles / primitive (SH 0 3)", configurations of one kind together.
std::string list_configurations() {
  std::vector<std::pair<std::string, std::set<int>>> kinds;
  for (auto const& r : configurations()) {
    std::string const kind = std::string(to_string(r.info.backend)) + " / " + to_string(r.info.tracer) + " / " +
                             r.info.backward + peculiarities(r.info);
    auto const same = std::find_if(kinds.begin(), kinds.end(), [&](auto const& k) { return k.first == kind; });
    (same == kinds.end() ? kinds.emplace_back(kind, std::set<int>{}) : *same).second.insert(r.info.stored_degree);
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
         (wanted.backward == "auto" || wanted.backward == there.backward) && wanted.sh_degree >= 0 &&
         wanted.sh_degree <= there.stored_degree && wanted.depth == there.depth &&
         wanted.kernel_degree == there.kernel_degree && (wanted.ranks != nullptr) == there.ranks &&
         matches(wanted.hit_format, there.hit_format) &&
         ((wanted.device == 0 && !wanted.stream) || there.backend == backend_kind::cuda);
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
  bool const by_optix = request.tracer == tracer_kind::optix;
  if (!unavailable.empty())
    throw unsupported("backend " + unavailable + ": " + reason +
                      (by_optix ? "; use configuration_request.tracer = bvh, which gives the same image"
                                : "; use configuration_request.backend = openmp, which needs no device"));
  if (by_optix && std::none_of(configurations().begin(), configurations().end(),
                               [](auto const& r) { return r.info.tracer == tracer_kind::optix; }))
    throw unsupported(
        "tracer optix is not in this build: configure gart with -DGART_OPTIX=ON -DOptiX_ROOT=FOLDER, NVIDIA's OptiX "
        "SDK, or use configuration_request.tracer = bvh, which gives the same image");
  throw unsupported("no compiled configuration for " + as_text(request) +
                    "; there are (backend / tracer / backward): " + list_configurations() +
                    ". A program compiles configurations of its own with GART_REGISTER_CONFIGURATIONS: "
                    "gart/runtime/compiled_configurations.hpp, shown by examples/5_own_configuration");
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
