#include "commands.hpp"
#include "help.hpp"
#include "printable.hpp"
#include "progress.hpp"
#include "ranks.hpp"
#include "self_test.hpp"

#include <gart/core/error.hpp>
#include <gart/core/version.hpp>
#include <gart/core/words.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/runtime/session.hpp>

#if defined(GART_WITH_CUDA)
#include <gart/exec/cuda.hpp>
#endif
#if defined(GART_WITH_OPTIX)
#include <gart/trace/optix_tracer.hpp>
#endif
#if defined(GART_WITH_NCCL)
#include <gart/comm/nccl_comm.hpp>
#endif
#if defined(GART_WITH_MPI)
#include <gart/comm/mpi_comm.hpp>
#endif

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

namespace gart_cli {

namespace {

#if defined(GART_WITH_CUDA)
// How the GPUs of this host reach each other: the pairs of each kind.
void print_links(int devices) {
  std::map<gart::device_link, std::string> pairs;
  try {
    for (int one = 0; one < devices; ++one)
      for (int other = one + 1; other < devices; ++other)
        pairs[gart::link_between(one, other)] += " " + std::to_string(one) + "-" + std::to_string(other);
  } catch (gart::error const& e) {
    std::printf("links      not known (%s)\n", e.what());
    return;
  }
  for (auto const& [link, which] : pairs)
    std::printf("links     %s %s\n", which.c_str(),
                link == gart::device_link::host     ? "through the host's memory"
                : link == gart::device_link::direct ? "to each other's memory, as by PCIe"
                                                    : "to each other's memory, with atomic operations, as by NVLink");
}
#endif

// The host and device of each rank, the same for two that share a GPU. Empty where no launcher started ranks.
std::vector<std::string> places_of_ranks() {
#if defined(GART_WITH_MPI)
  if (gart::mpi_comm const* const all = ranks::comm()) {
    std::string mine = all->host() + ", host processors";
#if defined(GART_WITH_NCCL)
    if (auto const devices = gart::cuda_devices(); !devices.empty()) {
      auto const device = static_cast<std::size_t>(gart::nccl_comm::device_of(*all));
      mine = all->host() + ", GPU " + std::to_string(device) + " (" + devices[device].name + ")";
    }
#endif
    return ranks::gathered(mine);
  }
#endif
  return {};
}

void print_ranks(std::vector<std::string> const& places) {
#if defined(GART_WITH_MPI)
  std::printf("ranks      by MPI: mpirun -n N gart train; started here: %d\n", ranks::size());
  for (std::size_t r = 0; r < places.size(); ++r) std::printf("           rank %zu on %s\n", r, places[r].c_str());
#if defined(GART_WITH_NCCL)
  std::printf("           a GPU each: NCCL %s; gart train --gpus N\n", gart::nccl_comm::version().c_str());
  bool const shared = std::set<std::string>(places.begin(), places.end()).size() < places.size();
  if (shared && !gart::cuda_devices().empty())
    std::puts("           two of these share a GPU: their messages pass through the host, slowly");
#endif
#else
  static_cast<void>(places);
  std::puts("ranks      not in this build (MPI)");
#endif
}

void print_devices(std::vector<std::string> const& places) {
  std::set<std::string> compiled_for;
  for (auto const& r : gart::compiled_configurations())
    if (!r.instruction_set.empty()) compiled_for.insert(r.instruction_set);
  std::printf("cpu        %u threads, configurations compiled for", std::thread::hardware_concurrency());
  for (auto const& one : compiled_for) std::printf(" %s", one.c_str());
  std::puts("");
#if defined(GART_WITH_CUDA)
  std::string reason;
  auto const devices = gart::cuda_devices(&reason);
  if (devices.empty()) std::printf("cuda       no device (%s)\n", reason.c_str());
  for (auto const& d : devices) {
    std::printf("cuda       %s, sm_%d%d, %d multiprocessors, %s\n", d.name.c_str(), d.compute_major, d.compute_minor,
                d.multiprocessors, as_bytes(static_cast<double>(d.total_bytes)).c_str());
  }
  print_links(static_cast<int>(devices.size()));
#else
  std::puts("cuda       not in this build");
#endif
#if defined(GART_EMBREE_VERSION)
  std::puts("embree     " GART_EMBREE_VERSION);
#else
  std::puts("embree     not in this build");
#endif
#if defined(GART_WITH_OPTIX)
  std::string const missing = gart::optix_available(&reason) ? "" : " (" + reason + ")";
  std::printf("optix      %s%s\n", gart::optix_scene::version(), missing.c_str());
#else
  std::puts("optix      not in this build");
#endif
  print_ranks(places);
  auto const name = [](gart::splat_format const* format) { return format->name; };
  std::printf("models     %s\n", gart::joined(gart::splat_formats(), name).c_str());
}

// From the least to the greatest of all but a hundredth, an axis.
void print_box(gart::gaussian_model const& model) {
  std::size_t const n = model.size(), out = n / 200;
  std::vector<float> values(n);
  for (std::size_t c = 0; c < 3 && n > 0; ++c) {
    for (std::size_t i = 0; i < n; ++i) values[i] = model.mean[3 * i + c];
    std::sort(values.begin(), values.end());
    std::printf("%-10s %.6g to %.6g, 99 of 100 of them\n", std::string(1, "xyz"[c]).c_str(),
                static_cast<double>(values[out]), static_cast<double>(values[n - 1 - out]));
  }
}

void print_origin(gart::vec3d const& origin) {
  if (origin == gart::vec3d(0.0))
    std::puts("origin     none: coordinates are those of the files");
  else
    std::printf("origin     %s\n", gart::to_text(origin).c_str());
}

int print_model(std::filesystem::path const& path) {
  gart::splat_traits traits;
  std::vector<std::string> notes;
  gart::gaussian_model const model = gart::read_splats(path, &traits, &notes);
  std::printf("model      %s\n", printable(path.string()).c_str());
  std::string const features = model.feature_count ? ", " + std::to_string(model.feature_count) + " features each" : "";
  std::printf("Gaussians  %s, SH degree %d%s\n", with_commas(model.size()).c_str(), model.sh_degree, features.c_str());
  print_origin(gart::origin_of(traits, path.string()));
  print_box(model);
  for (auto const& [key, value] : traits)
    if (key != "origin") std::printf("%-10s %s\n", printable(key).c_str(), printable(value).c_str());
  for (auto const& note : notes) std::printf("%s\n", printable(note).c_str());
  return 0;
}

int print_capture(std::filesystem::path const& path) {
  gart::dataset_options options;
  options.load_images = false;
  gart::dataset const data = gart::load_dataset(path, options);
  std::printf("capture    %s, %s\n", printable(path.string()).c_str(), data.format.c_str());
  std::printf("views      %zu to train on, %zu to test on: %s\n", data.train.size(), data.test.size(),
              printable(data.split).c_str());
  std::printf("points     %s\n", with_commas(data.points.size()).c_str());
  print_origin(data.origin);
  std::printf("extent     %.6g\n", static_cast<double>(data.extent));
  for (auto const& note : data.notes) std::printf("%s\n", printable(note).c_str());
  return 0;
}

// A folder is a capture, and so are the files that captures are named by.
bool names_capture(std::filesystem::path const& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return !std::filesystem::exists(path / "meta.json", ignored);
  std::string const extension = path.extension().string();
  return extension == ".json" || extension == ".bin" || extension == ".txt";
}

int run_info(bool tests) {
  if (ranks::built) ranks::start(false);
  std::vector<std::string> const places = places_of_ranks();
  if (ranks::rank() > 0) return 0;
  std::printf("gart       %s\n", gart::version);
  print_devices(places);
  // Configurations that differ only in the degree of the spherical harmonics share a line.
  std::map<std::tuple<std::string, std::string, std::string, int, std::string>, std::set<int>> configurations;
  for (auto const& r : gart::compiled_configurations()) {
    configurations[{to_string(r.backend), to_string(r.tracer),
                    r.backward + (r.depth ? "+depth" : "") + (r.ranks ? "+ranks" : ""), r.kernel_degree,
                    to_string(r.hit_format)}]
        .insert(r.stored_degree);
  }
  std::puts("\nbackend  tracer  backward            kernel  hit format  SH degrees stored");
  for (auto const& [names, degrees] : configurations) {
    auto const& [backend, tracer, backward, kernel_degree, hit_format] = names;
    std::printf("%-8s %-7s %-19s %-7d %-10s", backend.c_str(), tracer.c_str(), backward.c_str(), kernel_degree,
                hit_format.c_str());
    for (int const degree : degrees) std::printf(" %d", degree);
    std::puts("");
  }
  auto const best = gart::resolve({});
  std::printf("\nauto means %s, %s, %s here.\n", to_string(best.backend), to_string(best.tracer),
              best.backward.c_str());
  if (!tests) return 0;
  std::puts("\nA small scene against its image and gradients by their definition, in double:");
  return self_test() == 0 ? 0 : exit_failed;
}

}  // namespace

void add_info(CLI::App& app, command& selected) {
  auto tests = std::make_shared<bool>(false);
  CLI::App* info = app.add_subcommand("info", "Say what this build and this machine can do.");
  info->add_flag("--self-test", *tests, "Try every configuration that runs here; exit code 1 where one is wrong");
  info->footer(
      "\nPrints the version, the devices found, and the configurations that were compiled: which backend, tracer and\n"
      "backward pass go together, for which degrees of spherical harmonics. Writes nothing. For several GPUs it\n"
      "says how they reach each other's memory, for several ranks the host and device of each.\n"
      "For a file of Gaussians, or a capture, it lists the contents, and the origin of the coordinates.\n"
      "\nExamples:\n"
      "  gart info\n"
      "  gart info run/model.ply\n"
      "  gart info | grep cuda\n"
      "  gart info --self-test                    after an installation: seconds\n"
      "  mpirun -n 4 gart info");
  auto path = std::make_shared<std::filesystem::path>();
  add_open(*info, "PATH", *path, "", "Of this model or capture instead: what is in it");
  info->callback([tests, path, &selected] {
    selected = [tests, path] {
      return path->empty() ? run_info(*tests) : names_capture(*path) ? print_capture(*path) : print_model(*path);
    };
  });
}

}  // namespace gart_cli
