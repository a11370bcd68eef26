// Messages between GPUs by NCCL, or through the host where ranks share one.
#include <gart/comm/nccl_comm.hpp>

#include "../cuda/check.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <nccl.h>

namespace gart {

namespace {

void check_nccl(ncclResult_t code, char const* what, ncclComm_t comm = nullptr) {
  if (code == ncclSuccess) return;
  char const* const more = ncclGetLastError(comm);
  throw error(std::string("NCCL failed while ") + what + ": " + ncclGetErrorString(code) +
              (more && *more ? std::string(" (") + more + ")" : std::string()) +
              "; NCCL_DEBUG=INFO in the environment says more");
}

// Pinned host memory, growing.
struct pinned {
  char* bytes = nullptr;
  std::size_t size = 0;
  ~pinned() { cudaFreeHost(bytes); }
  char* room(std::size_t wanted) {
    if (wanted <= size) return bytes;
    cudaFreeHost(bytes), bytes = nullptr, size = 0;
    void* fresh = nullptr;
    detail::check_cuda(cudaMallocHost(&fresh, wanted), "allocating pinned host memory for messages");
    return size = wanted, bytes = static_cast<char*>(fresh);
  }
};

std::size_t total(std::vector<message> const& messages) {
  std::size_t sum = 0;
  for (message const& m : messages) sum += m.bytes;
  return sum;
}

}  // namespace

struct nccl_comm::state {
  ncclComm_t comm = nullptr;
  device_transport transport = device_transport::host;
  int device = 0, sharers = 1;
  pinned out, in;
  cudaStream_t stream = nullptr;                    // NCCL's
  cudaEvent_t queued = nullptr, arrived = nullptr;  // before a group, on the policy's stream; after it, on NCCL's
  bool under_way = false;

  state() = default;
  state(state const&) = delete;
  state& operator=(state const&) = delete;
  ~state() {
    if (!comm) return;
    cudaSetDevice(device);
    ncclCommDestroy(comm);
    cudaEventDestroy(queued), cudaEventDestroy(arrived), cudaStreamDestroy(stream);
  }
};

int nccl_comm::device_of(mpi_comm const& ranks) {
  int const devices = static_cast<int>(cuda_devices().size());
  return devices ? ranks.rank_on_host() % devices : 0;
}

std::string nccl_comm::version() {
  int v = 0;
  check_nccl(ncclGetVersion(&v), "asking for its version");
  return std::to_string(v / 10000) + "." + std::to_string(v / 100 % 100) + "." + std::to_string(v % 100);
}

nccl_comm::nccl_comm(mpi_comm ranks, int device, device_transport transport)
    : ranks_(std::move(ranks)), state_(std::make_shared<state>()) {
  state& s = *state_;
  s.device = device;
  // Whose GPU is whose: by the driver's name of it, which is one on all hosts.
  cudaDeviceProp properties{};
  detail::check_cuda(cudaGetDeviceProperties(&properties, device), "reading a device's properties");
  std::vector<cudaUUID_t> all(static_cast<std::size_t>(size()));
  ranks_.all_gather(&properties.uuid, all.data(), sizeof(cudaUUID_t));
  auto const as_many = [&](cudaUUID_t const& id) {
    return static_cast<int>(
        std::count_if(all.begin(), all.end(), [&](auto const& x) { return !std::memcmp(&x, &id, sizeof x); }));
  };
  s.sharers = as_many(properties.uuid);
  bool const apart = std::all_of(all.begin(), all.end(), [&](auto const& id) { return as_many(id) == 1; });
  if (transport == device_transport::nccl && !apart)
    throw invalid_argument(
        "nccl_comm: transport nccl needs a GPU for each rank, and ranks share one; start as many ranks as there are "
        "GPUs, or take device_transport::automatic");
  s.transport =
      transport == device_transport::automatic ? apart ? device_transport::nccl : device_transport::host : transport;
  if (s.transport != device_transport::nccl || size() == 1) return;
  ::setenv("NCCL_NVLS_ENABLE", "0", 0);
  detail::check_cuda(cudaSetDevice(device), "choosing the device");
  ncclUniqueId id{};
  if (rank() == 0) check_nccl(ncclGetUniqueId(&id), "making an id for the ranks");
  ranks_.broadcast(&id, sizeof id, 0);
  int least = 0, most = 0;  // messages go before what could wait
  detail::check_cuda(cudaDeviceGetStreamPriorityRange(&least, &most), "reading a device's properties");
  detail::check_cuda(cudaStreamCreateWithPriority(&s.stream, cudaStreamNonBlocking, most), "making a stream");
  for (cudaEvent_t* event : {&s.queued, &s.arrived})
    detail::check_cuda(cudaEventCreateWithFlags(event, cudaEventDisableTiming), "making an event");
  check_nccl(ncclCommInitRank(&s.comm, size(), id, rank()), "connecting the ranks' GPUs");
}

int nccl_comm::sharers() const { return state_->sharers; }
device_transport nccl_comm::transport() const { return state_->transport; }

void nccl_comm::finish(cuda_exec& exec) {
  state& s = *state_;
  if (!std::exchange(s.under_way, false)) return;
  detail::check_cuda(cudaStreamWaitEvent(static_cast<cudaStream_t>(exec.stream()), s.arrived), "waiting for messages");
}

void nccl_comm::begin(cuda_exec& exec, span<message const> sends, span<message const> receives) {
  finish(exec);
  state& s = *state_;
  exec.make_current();
  cudaStream_t const stream = static_cast<cudaStream_t>(exec.stream());
  // To itself: the k-th that leaves is the k-th that arrives.
  std::array<std::vector<message>, 2> to_self, to_others;
  for (std::size_t way = 0; way < 2; ++way)
    for (message const& m : way == 0 ? sends : receives) {
      if (m.rank < 0 || m.rank >= size())
        throw invalid_argument("nccl_comm: there is no rank " + std::to_string(m.rank) + ", there are " +
                               std::to_string(size()));
      (m.rank == rank() ? to_self : to_others)[way].push_back(m);
    }
  if (to_self[0].size() != to_self[1].size())
    throw invalid_argument("nccl_comm: a message to itself has nobody to take it");
  for (std::size_t k = 0; k < to_self[0].size(); ++k) {
    if (to_self[0][k].bytes != to_self[1][k].bytes)
      throw invalid_argument("nccl_comm: a message to itself is taken as it is sent");
    if (to_self[0][k].bytes) exec.copy(to_self[1][k].data, to_self[0][k].data, to_self[0][k].bytes);
  }
  if (s.comm) {
    if (to_others[0].empty() && to_others[1].empty()) return;
    detail::check_cuda(cudaEventRecord(s.queued, stream), "exchanging messages");
    detail::check_cuda(cudaStreamWaitEvent(s.stream, s.queued), "exchanging messages");
    check_nccl(ncclGroupStart(), "grouping messages", s.comm);
    for (message const& m : to_others[0])
      check_nccl(ncclSend(m.data, m.bytes, ncclUint8, m.rank, s.comm, s.stream), "sending", s.comm);
    for (message const& m : to_others[1])
      check_nccl(ncclRecv(m.data, m.bytes, ncclUint8, m.rank, s.comm, s.stream), "receiving", s.comm);
    check_nccl(ncclGroupEnd(), "exchanging messages", s.comm);
    detail::check_cuda(cudaEventRecord(s.arrived, s.stream), "exchanging messages");
    s.under_way = true;
    return;
  }
  char* const places[2] = {s.out.room(total(to_others[0])), s.in.room(total(to_others[1]))};
  std::array<std::vector<message>, 2> here;
  for (std::size_t way = 0; way < 2; ++way) {
    char* at = places[way];
    for (message const& m : to_others[way]) here[way].push_back({m.rank, at, m.bytes}), at += m.bytes;
  }
  for (std::size_t k = 0; k < here[0].size(); ++k)
    detail::check_cuda(
        cudaMemcpyAsync(here[0][k].data, to_others[0][k].data, here[0][k].bytes, cudaMemcpyDeviceToHost, stream),
        "copying messages to the host");
  exec.synchronize();
  ranks_.exchange({here[0].data(), here[0].size()}, {here[1].data(), here[1].size()});
  for (std::size_t k = 0; k < here[1].size(); ++k)
    detail::check_cuda(
        cudaMemcpyAsync(to_others[1][k].data, here[1][k].data, here[1][k].bytes, cudaMemcpyHostToDevice, stream),
        "copying messages from the host");
  exec.synchronize();
}

}  // namespace gart
