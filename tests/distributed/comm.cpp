// A communicator's messages and sums, by MPI and by one rank alone.
#include "policy.hpp"

#include <doctest/doctest.h>

#include <gart/comm/self_comm.hpp>
#include <gart/exec/buffer.hpp>

#include <vector>

using namespace gart;
using gart_test::every_rank, gart_test::exec_type, gart_test::rank_comm;
static_assert(communicator<self_comm, exec_type> && communicator<rank_comm, exec_type>);

namespace {

template <class Comm>
void check(Comm comm) {
  exec_type exec = gart_test::make_exec();
  int const size = comm.size(), rank = comm.rank();
  auto const n = static_cast<std::size_t>(size);
  REQUIRE((rank >= 0 && rank < size));

  // Each rank sends (rank + 1) words of 100 rank + to, to each; one message to itself among them, and none to the next.
  std::vector<buffer<u32, exec_type>> out, in;
  std::vector<message> sends, receives;
  for (int r = 0; r < size; ++r) {
    auto const k = static_cast<std::size_t>(r);
    out.emplace_back(exec, std::vector<u32>(static_cast<std::size_t>(rank) + 1, static_cast<u32>(100 * rank + r)));
    in.emplace_back(exec, std::vector<u32>(k + 1));
    sends.push_back({r, out[k].data(), out[k].size() * sizeof(u32)});
    receives.push_back({r, in[k].data(), in[k].size() * sizeof(u32)});
  }
  comm.exchange(exec, {sends.data(), n}, {receives.data(), n});
  for (int r = 0; r < size; ++r)
    for (u32 const word : in[static_cast<std::size_t>(r)].to_host()) CHECK(word == static_cast<u32>(100 * r + rank));

  // Beside the queue: what is queued after finish has what was sent, and a second group ends the first.
  for (std::size_t k = 0; k < n; ++k) in[k].zero();
  comm.begin(exec, {sends.data(), n}, {receives.data(), n});
  comm.finish(exec);
  buffer<u32, exec_type> copied(exec, n);
  for (std::size_t k = 0; k < n; ++k) exec.copy(copied.data() + k, in[k].data() + k, sizeof(u32));
  auto const firsts = copied.to_host();
  for (std::size_t k = 0; k < n; ++k) CHECK(firsts[k] == static_cast<u32>(100 * k) + static_cast<u32>(rank));
  for (std::size_t k = 0; k < n; ++k) in[k].zero();
  for (int time = 0; time < 2; ++time) comm.begin(exec, {sends.data(), n}, {receives.data(), n});
  comm.finish(exec);
  comm.finish(exec);  // nothing is under way
  for (int r = 0; r < size; ++r)
    for (u32 const word : in[static_cast<std::size_t>(r)].to_host()) CHECK(word == static_cast<u32>(100 * r + rank));

  // Two messages between the same ranks arrive in their order.
  u32 const first = static_cast<u32>(rank), second = first + 1000;
  u32 got[2] = {};
  message const two[] = {{(rank + 1) % size, const_cast<u32*>(&first), 4},
                         {(rank + 1) % size, const_cast<u32*>(&second), 4}};
  message const from[] = {{(rank + size - 1) % size, got, 4}, {(rank + size - 1) % size, got + 1, 4}};
  comm.exchange({two, 2}, {from, 2});
  CHECK(got[0] == static_cast<u32>((rank + size - 1) % size));
  CHECK(got[1] == got[0] + 1000);

  double const mine[2] = {1.0 * rank, -2.0 * rank};
  std::vector<double> all(2 * n);
  comm.all_gather(mine, all.data(), sizeof mine);
  for (std::size_t r = 0; r < n; ++r) {
    CHECK(all[2 * r] == 1.0 * static_cast<double>(r));
    CHECK(all[2 * r + 1] == -2.0 * static_cast<double>(r));
  }

  // In the order of ranks: 1 + 2^-53 + 2^-53 is 1, any other order is more.
  double sum[1] = {rank == 0 ? 1.0 : 0x1p-53};
  comm.all_reduce(span<double>(sum, 1));
  CHECK(sum[0] == 1.0);
  u64 counts[2] = {static_cast<u64>(rank) + 1, ~u64{0}};
  comm.all_reduce(span<u64>(counts, 2));
  CHECK(counts[0] == n * (n + 1) / 2);
  CHECK(counts[1] == u64{0} - n);  // it wraps

  CHECK(comm.exclusive_scan(static_cast<u64>(rank) + 1) == static_cast<u64>(rank) * (static_cast<u64>(rank) + 1) / 2);
  for (int root = 0; root < size; ++root) {
    int value = rank == root ? 7 + root : 0;
    comm.broadcast(&value, sizeof value, root);
    CHECK(value == 7 + root);
  }
  comm.barrier();
}

}  // namespace

TEST_CASE("messages, sums and broadcasts between ranks") {
  check(every_rank());
  check(self_comm());
#if defined(GART_TEST_CUDA)
  mpi_comm const ranks;
  check(nccl_comm(ranks, nccl_comm::device_of(ranks), device_transport::host));
#endif
}

TEST_CASE("a rank that there is not is refused") {
  rank_comm comm = every_rank();
  int value = 0;
  message const wrong{comm.size(), &value, sizeof value};
  CHECK_THROWS_AS(comm.exchange({&wrong, 1}, {}), invalid_argument);
  exec_type exec = gart_test::make_exec();
  CHECK_THROWS_AS(comm.exchange(exec, {&wrong, 1}, {}), invalid_argument);
  CHECK_THROWS_AS(comm.broadcast(&value, sizeof value, -1), invalid_argument);
  CHECK_THROWS_AS(self_comm().exchange({&wrong, 1}, {}), invalid_argument);
}
