#include "commands.hpp"
#include "progress.hpp"
#include "ranks.hpp"

#include <gart/core/version.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/runtime/session.hpp>

#if defined(GART_WITH_CUDA)
#include <gart/exec/cuda.hpp>
#endif
#if defined(GART_WITH_NCCL)
#include <gart/comm/nccl_comm.hpp>
#endif

#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <tuple>

namespace gart_cli {

namespace {

void print_devices() {
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
#else
  std::puts("cuda       not in this build");
#endif
#if defined(GART_EMBREE_VERSION)
  std::puts("embree     " GART_EMBREE_VERSION);
#else
  std::puts("embree     not in this build");
#endif
#if defined(GART_WITH_MPI)
  std::printf("ranks      MPI: mpirun -n N gart train; launched as %d\n", ranks::launched());
#if defined(GART_WITH_NCCL)
  std::printf("           a GPU each: NCCL %s; gart train --gpus N\n", gart::nccl_comm::version().c_str());
#endif
#else
  std::puts("ranks      not in this build (MPI)");
#endif
  std::string formats;
  for (auto const* format : gart::splat_formats()) formats += std::string(formats.empty() ? "" : ", ") + format->name;
  std::printf("models     %s\n", formats.c_str());
}

int run_info() {
  std::printf("gart       %s\n", gart::version);
  print_devices();
  // Configurations that differ only in the degree of the spherical harmonics share a line.
  std::map<std::tuple<std::string, std::string, std::string, int, std::string, std::string, int, int>, std::set<int>>
      configurations;
  for (auto const& r : gart::compiled_configurations()) {
    configurations[{to_string(r.backend), to_string(r.tracer),
                    r.backward + (r.depth ? "+depth" : "") + (r.ranks ? "+ranks" : ""), r.kernel_degree,
                    to_string(r.arithmetic), to_string(r.lt_format), r.tile_size, r.window}]
        .insert(r.sh_degree);
  }
  std::puts("\nbackend  tracer  backward            kernel  arithmetic  LT format  tile  window  SH degrees");
  for (auto const& [names, degrees] : configurations) {
    auto const& [backend, tracer, backward, kernel_degree, arithmetic, lt_format, tile_size, window] = names;
    std::printf("%-8s %-7s %-19s %-7d %-11s %-10s %-5d %-7d", backend.c_str(), tracer.c_str(), backward.c_str(),
                kernel_degree, arithmetic.c_str(), lt_format.c_str(), tile_size, window);
    for (int const degree : degrees) std::printf(" %d", degree);
    std::puts("");
  }
  auto const best = gart::resolve({});
  std::printf("\nauto means %s, %s, %s here.\n", to_string(best.backend), to_string(best.tracer),
              best.backward.c_str());
  return 0;
}

}  // namespace

void add_info(CLI::App& app, command& selected) {
  CLI::App* info = app.add_subcommand("info", "Say what this build and this machine can do.");
  info->footer(
      "\nPrints the version, the devices found, and the configurations that were compiled: which backend, tracer and\n"
      "backward pass go together, for which degrees of spherical harmonics. Writes nothing.\n"
      "\nExamples:\n"
      "  gart info\n"
      "  gart info | grep cuda");
  info->callback([&selected] { selected = run_info; });
}

}  // namespace gart_cli
