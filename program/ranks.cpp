#include "ranks.hpp"

#include "commands.hpp"

#if defined(GART_WITH_MPI)
#include <gart/comm/gathered.hpp>
#include <gart/comm/mpi_comm.hpp>
#endif
#if defined(GART_WITH_NCCL)
#include <gart/exec/cuda.hpp>
#endif

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#if defined(_OPENMP)
#include <omp.h>
#endif
#include <sched.h>
#include <unistd.h>

namespace gart_cli {

namespace {

// OpenMPI's mpirun; MPICH's and Intel's; Slurm's srun with PMIx says the rank alone.
int first_of(std::initializer_list<char const*> names, int otherwise) {
  for (char const* name : names)
    if (char const* const value = std::getenv(name)) return std::atoi(value);
  return otherwise;
}

#if defined(GART_WITH_MPI)
std::unique_ptr<gart::mpi_comm>& started() {
  static std::unique_ptr<gart::mpi_comm> all;
  return all;
}

// The default number of threads of a rank: its share of the cores that the launcher gives it. Each of several would
// start a thread a core otherwise, and wait for the others' at every loop.
#if defined(_OPENMP)
void share_cores(gart::mpi_comm& all) {
  struct seat {
    char host[64] = {};
    cpu_set_t cores;
  } mine;
  std::strncpy(mine.host, all.host().c_str(), sizeof mine.host - 1);
  CPU_ZERO(&mine.cores);
  ::sched_getaffinity(0, sizeof mine.cores, &mine.cores);
  std::vector<seat> const seats = gart::gathered(all, mine);  // on all ranks: hosts may differ in their messages
  if (std::getenv("OMP_NUM_THREADS")) return;
  auto const sharers = std::count_if(seats.begin(), seats.end(), [&](seat const& s) {
    cpu_set_t both;
    CPU_AND(&both, &s.cores, &mine.cores);
    return std::strcmp(s.host, mine.host) == 0 && CPU_COUNT(&both) > 0;
  });
  omp_set_num_threads(std::max(1, CPU_COUNT(&mine.cores) / std::max(1, static_cast<int>(sharers))));
}
#else
void share_cores(gart::mpi_comm&) {}
#endif
#endif

}  // namespace

int ranks::launched() { return first_of({"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}, 1); }
int ranks::launched_rank() {
  return launched() > 1 ? first_of({"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK", "SLURM_PROCID"}, 0) : 0;
}

void ranks::launch_on(int gpus, char** argv) {
  std::string const asked = "--gpus " + std::to_string(gpus) + ": ";
  if (launched() > 1 && gpus > 1 && launched() != gpus)
    throw usage_error(asked + std::to_string(launched()) + " ranks were started (leave --gpus out under mpirun)");
  if (launched() > 1 || gpus == 1) return;
#if defined(GART_WITH_NCCL)
  std::string reason;
  auto const found = gart::cuda_devices(&reason).size();
  if (found < static_cast<std::size_t>(gpus))
    throw usage_error(asked + "this host has " + std::to_string(found) + (found ? "" : " (" + reason + ")"));
  // A rank's threads go where there is room, not all to one core; and root may.
  ::setenv("OMPI_MCA_hwloc_base_binding_policy", "none", 0);
  if (::geteuid() == 0) ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0), ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
  std::string launcher = "mpirun", option = "-n", count = std::to_string(gpus),
              self = std::filesystem::read_symlink("/proc/self/exe").string();
  std::vector<char*> line = {launcher.data(), option.data(), count.data(), self.data()};
  for (char** word = argv + 1; *word; ++word) line.push_back(*word);
  line.push_back(nullptr);
  ::execvp(launcher.c_str(), line.data());
  throw usage_error(asked + "mpirun cannot be started: " + std::strerror(errno) + " (install openmpi-bin)");
#else
  (void)argv;
  throw usage_error(asked + "this gart was built without NCCL (build it where CUDA, MPI and NCCL are)");
#endif
}

#if defined(GART_WITH_MPI)
bool const ranks::built = true;
void ranks::start(bool wanted) {
  if (started() || (launched() <= 1 && !wanted)) return;
  started() = std::make_unique<gart::mpi_comm>();
  share_cores(*started());
}
gart::mpi_comm* ranks::comm() { return started().get(); }
int ranks::size() { return comm() ? comm()->size() : 1; }
int ranks::rank() { return comm() ? comm()->rank() : 0; }
gart::host_group* ranks::on_host() {
  static std::shared_ptr<gart::host_group> const all = comm() ? comm()->on_host() : nullptr;
  return all && all->size() > 1 ? all.get() : nullptr;
}
std::string ranks::name() {
  if (size() == 1) return {};
  return "rank " + std::to_string(comm()->rank()) + " of " + std::to_string(size()) + " (" + comm()->host() + "): ";
}
void ranks::broadcast(void* data, std::size_t bytes) {
  if (size() > 1) comm()->broadcast(data, bytes, 0);
}
void ranks::gather(void const* mine, void* all, std::size_t bytes) {
  if (size() > 1) comm()->all_gather(mine, all, bytes);
}
std::vector<std::string> ranks::gathered(std::string const& mine) {
  if (size() == 1) return {mine};
  return gart::gathered(*comm(), mine);
}
gart::u64 ranks::largest(gart::u64 value) {
  std::vector<gart::u64> const all = of_all(value);
  return *std::max_element(all.begin(), all.end());
}
void ranks::barrier() {
  if (size() > 1) comm()->barrier();
}
void ranks::end_all(int code) {
  if (size() > 1) comm()->abort(code);
  std::exit(code);
}
#else
bool const ranks::built = false;
void ranks::start(bool wanted) {
  if (launched() > 1 || wanted)
    throw usage_error(
        "this gart was built without MPI, and trains alone and a view a step (install libopenmpi-dev and "
        "build it again, or start it without mpirun and with --batch 1)");
}
gart::mpi_comm* ranks::comm() { return nullptr; }
int ranks::size() { return 1; }
int ranks::rank() { return 0; }
gart::host_group* ranks::on_host() { return nullptr; }
std::string ranks::name() { return {}; }
void ranks::broadcast(void*, std::size_t) {}
void ranks::gather(void const*, void*, std::size_t) {}
std::vector<std::string> ranks::gathered(std::string const& mine) { return {mine}; }
gart::u64 ranks::largest(gart::u64 value) { return value; }
void ranks::barrier() {}
void ranks::end_all(int code) { std::exit(code); }
#endif

void ranks::wait_to_speak() {
  if (launched_rank() > 0) std::this_thread::sleep_for(std::chrono::seconds(1));
}

}  // namespace gart_cli
