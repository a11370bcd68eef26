// Ranks by MPI.
#include <gart/comm/mpi_comm.hpp>
#include <gart/core/error.hpp>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include <mpi.h>

namespace gart {

namespace {

constexpr std::size_t piece = std::size_t{1} << 30;  // MPI counts in int

// MPI ends with the program, not with the last communicator: it cannot be started twice.
struct mpi_library {
  mpi_library() {
    int there = 0;
    MPI_Initialized(&there);
    if (there) return;
    int given = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given);
    ours = true;
  }
  ~mpi_library() {
    int over = 0;
    MPI_Finalized(&over);
    if (ours && !over) MPI_Finalize();
  }
  bool ours = false;
};

// f(first byte, bytes) for each piece.
template <class F>
void in_pieces(std::size_t bytes, F const& f) {
  for (std::size_t at = 0; at < bytes; at += piece) f(at, static_cast<int>(std::min(piece, bytes - at)));
}

}  // namespace

struct mpi_comm::state {
  MPI_Comm all = MPI_COMM_NULL;
  int rank = 0, size = 1, on_host = 1, rank_on_host = 0;

  // Of its own, so that messages of the program's cannot be taken for these.
  state() {
    static mpi_library const library;
    MPI_Comm_dup(MPI_COMM_WORLD, &all);
    MPI_Comm_rank(all, &rank), MPI_Comm_size(all, &size);
    MPI_Comm host = MPI_COMM_NULL;
    MPI_Comm_split_type(all, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &host);
    MPI_Comm_size(host, &on_host), MPI_Comm_rank(host, &rank_on_host);
    MPI_Comm_free(&host);
  }
  ~state() {
    int over = 0;
    MPI_Finalized(&over);
    if (!over) MPI_Comm_free(&all);
  }
  state(state const&) = delete;
  state& operator=(state const&) = delete;

  void require_rank(int other) const {
    if (other < 0 || other >= size)
      throw invalid_argument("mpi_comm: there is no rank " + std::to_string(other) + ", there are " +
                             std::to_string(size));
  }
  template <class T>
  void sum_in_order(span<T> values) const {
    std::vector<T> of_all(values.size() * static_cast<std::size_t>(size));
    int const bytes = static_cast<int>(values.size() * sizeof(T));
    MPI_Allgather(values.data(), bytes, MPI_BYTE, of_all.data(), bytes, MPI_BYTE, all);
    for (std::size_t i = 0; i < values.size(); ++i) {
      T sum = of_all[i];
      for (std::size_t r = 1; r < static_cast<std::size_t>(size); ++r) sum += of_all[r * values.size() + i];
      values[i] = sum;
    }
  }
};

mpi_comm::mpi_comm() : state_(std::make_shared<state>()) {}
int mpi_comm::rank() const { return state_->rank; }
int mpi_comm::size() const { return state_->size; }
int mpi_comm::ranks_on_host() const { return state_->on_host; }
int mpi_comm::rank_on_host() const { return state_->rank_on_host; }

std::string mpi_comm::host() const {
  char name[MPI_MAX_PROCESSOR_NAME] = {};
  int length = 0;
  MPI_Get_processor_name(name, &length);
  return {name, static_cast<std::size_t>(length)};
}

void mpi_comm::exchange(span<message const> sends, span<message const> receives) {
  for (message const& m : sends) state_->require_rank(m.rank);
  for (message const& m : receives) state_->require_rank(m.rank);
  std::vector<MPI_Request> under_way;
  // Those that receive first: what arrives has then a place to go to.
  for (message const& m : receives)
    in_pieces(m.bytes, [&](std::size_t at, int bytes) {
      MPI_Irecv(static_cast<char*>(m.data) + at, bytes, MPI_BYTE, m.rank, 0, state_->all, &under_way.emplace_back());
    });
  for (message const& m : sends)
    in_pieces(m.bytes, [&](std::size_t at, int bytes) {
      MPI_Isend(static_cast<char const*>(m.data) + at, bytes, MPI_BYTE, m.rank, 0, state_->all,
                &under_way.emplace_back());
    });
  MPI_Waitall(static_cast<int>(under_way.size()), under_way.data(), MPI_STATUSES_IGNORE);
}

void mpi_comm::all_gather(void const* mine, void* all, std::size_t bytes) {
  if (bytes <= piece) {
    int const n = static_cast<int>(bytes);
    MPI_Allgather(mine, n, MPI_BYTE, all, n, MPI_BYTE, state_->all);
    return;
  }
  std::vector<message> sends, receives;
  for (int r = 0; r < size(); ++r) {
    sends.push_back({r, const_cast<void*>(mine), bytes});
    receives.push_back({r, static_cast<char*>(all) + static_cast<std::size_t>(r) * bytes, bytes});
  }
  exchange({sends.data(), sends.size()}, {receives.data(), receives.size()});
}

void mpi_comm::all_reduce(span<double> values) { state_->sum_in_order(values); }
void mpi_comm::all_reduce(span<u64> values) { state_->sum_in_order(values); }

u64 mpi_comm::exclusive_scan(u64 value) {
  u64 before = 0;
  MPI_Exscan(&value, &before, 1, MPI_UINT64_T, MPI_SUM, state_->all);
  return rank() == 0 ? 0 : before;  // MPI leaves rank 0's undefined
}

void mpi_comm::broadcast(void* data, std::size_t bytes, int root) {
  state_->require_rank(root);
  in_pieces(bytes,
            [&](std::size_t at, int n) { MPI_Bcast(static_cast<char*>(data) + at, n, MPI_BYTE, root, state_->all); });
}

void mpi_comm::barrier() { MPI_Barrier(state_->all); }

void mpi_comm::abort(int code) {
  MPI_Abort(state_->all, code);
  std::_Exit(code);
}

}  // namespace gart
