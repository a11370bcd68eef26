// Ranks by MPI.
#include <gart/comm/mpi_comm.hpp>
#include <gart/core/error.hpp>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <mpi.h>
#include <sys/statvfs.h>
#include <unistd.h>

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
  MPI_Comm all = MPI_COMM_NULL, host = MPI_COMM_NULL;
  int rank = 0, size = 1, rank_on_host = 0, on_host = 1;

  // Of its own, so that messages of the program's cannot be taken for these.
  state() {
    static mpi_library const library;
    MPI_Comm_dup(MPI_COMM_WORLD, &all);
    MPI_Comm_rank(all, &rank), MPI_Comm_size(all, &size);
    MPI_Comm_split_type(all, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &host);
    MPI_Comm_rank(host, &rank_on_host), MPI_Comm_size(host, &on_host);
  }
  ~state() {
    int over = 0;
    MPI_Finalized(&over);
    if (!over) MPI_Comm_free(&all), MPI_Comm_free(&host);
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

// The ranks of this host. A window is not freed. All ranks would have to do it at once, and one that ends by an error
// does it alone. It goes with the processes.
class mpi_comm::host_ranks final : public host_group {
 public:
  explicit host_ranks(std::shared_ptr<state> all) : state_(std::move(all)) {}
  int rank() const override { return state_->rank_on_host; }
  int size() const override { return state_->on_host; }
  void all_gather(void const* mine, void* all, std::size_t bytes) override {
    int const n = static_cast<int>(bytes);
    MPI_Allgather(mine, n, MPI_BYTE, all, n, MPI_BYTE, state_->host);
  }
  void barrier() override {
    std::atomic_thread_fence(std::memory_order_seq_cst);
    MPI_Barrier(state_->host);
    std::atomic_thread_fence(std::memory_order_seq_cst);
  }
  std::shared_ptr<void> allocate(u64 bytes) override {
    // Found out before: a window that its file system has no room for ends a process where it is touched.
    u64 room = ~u64{0};
    if (struct statvfs there = {}; ::statvfs("/dev/shm", &there) == 0) room = u64{there.f_bavail} * there.f_frsize;
    MPI_Bcast(&room, 1, MPI_UINT64_T, 0, state_->host);
    if (room < bytes + bytes / 16) return nullptr;
    MPI_Comm quiet = MPI_COMM_NULL;  // says what is wrong, in place of ending all ranks
    MPI_Comm_dup(state_->host, &quiet);
    MPI_Comm_set_errhandler(quiet, MPI_ERRORS_RETURN);
    void* begin = nullptr;
    MPI_Win window = MPI_WIN_NULL;
    int code = MPI_Win_allocate_shared(rank() == 0 ? static_cast<MPI_Aint>(bytes) : 0, 1, MPI_INFO_NULL, quiet, &begin,
                                       &window);
    MPI_Aint size = 0;
    int unit = 1;
    if (code == MPI_SUCCESS) code = MPI_Win_shared_query(window, 0, &size, &unit, &begin);
    if (code != MPI_SUCCESS)
      throw out_of_memory("the host's shared", bytes, 0,
                          "give /dev/shm, or MPI's temporary folder, more room, or raise dataset_options.downscale");
    return {begin, [](void*) {}};
  }

 private:
  std::shared_ptr<state> state_;
};

mpi_comm::mpi_comm() : state_(std::make_shared<state>()) {}
int mpi_comm::rank() const { return state_->rank; }
int mpi_comm::size() const { return state_->size; }
int mpi_comm::sharers() const { return state_->on_host; }
int mpi_comm::rank_on_host() const { return state_->rank_on_host; }
std::shared_ptr<host_group> mpi_comm::on_host() const { return std::make_shared<host_ranks>(state_); }

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

namespace {

// One that a rank has open for itself: what another does with its own cannot make this one wait.
class mpi_file final : public shared_file {
 public:
  mpi_file(std::filesystem::path const& path, bool create) : name_(path.string()) {
    // The system says why; MPI that it did not work.
    int const made = ::open(name_.c_str(), O_WRONLY | O_CLOEXEC | (create ? O_CREAT | O_TRUNC : 0), 0666);
    if (made < 0)
      throw io_error(name_, (create ? "cannot be created: " : "cannot be opened: ") + reason(errno),
                     "name a folder that exists and is writable, the same on all hosts");
    ::close(made);
    if (int const code = MPI_File_open(MPI_COMM_SELF, name_.c_str(), MPI_MODE_WRONLY, MPI_INFO_NULL, &file_);
        code != MPI_SUCCESS)
      throw io_error(name_, "cannot be opened: " + words_of(code), "check its permissions");
  }
  ~mpi_file() override {
    if (file_ != MPI_FILE_NULL) MPI_File_close(&file_);
  }
  mpi_file(mpi_file const&) = delete;
  mpi_file& operator=(mpi_file const&) = delete;

  void write(u64 at, void const* data, std::size_t bytes) override {
    in_pieces(bytes, [&](std::size_t done, int n) {
      MPI_Status status;
      errno = 0;
      int const code = MPI_File_write_at(file_, static_cast<MPI_Offset>(at + done),
                                         static_cast<char const*>(data) + done, n, MPI_BYTE, &status);
      int const system = errno;
      int written = 0;
      if (code == MPI_SUCCESS) MPI_Get_count(&status, MPI_BYTE, &written);
      if (written == n) return;
      // Some a disk that is full is no error to, but fewer bytes.
      fail(system                ? reason(system)
           : code != MPI_SUCCESS ? words_of(code)
                                 : "it took " + std::to_string(written) + " of " + std::to_string(n) + " bytes");
    });
  }
  void close() override {
    errno = 0;
    int const code = MPI_File_sync(file_), system = errno;
    int const closed = MPI_File_close(&file_);
    file_ = MPI_FILE_NULL;
    if (code != MPI_SUCCESS && system != EINVAL) fail(system ? reason(system) : words_of(code));  // some cannot sync
    if (closed != MPI_SUCCESS) fail(words_of(closed));
  }

 private:
  static std::string reason(int code) { return std::generic_category().message(code); }
  static std::string words_of(int code) {
    char text[MPI_MAX_ERROR_STRING] = {};
    int length = 0;
    MPI_Error_string(code, text, &length);
    return {text, static_cast<std::size_t>(length)};
  }
  [[noreturn]] void fail(std::string const& why) const {
    throw io_error(name_, "cannot be written: " + why,
                   "free some space or choose another folder; nothing was changed there");
  }
  std::string name_;
  MPI_File file_ = MPI_FILE_NULL;
};

}  // namespace

std::unique_ptr<shared_file> mpi_comm::open_file(std::filesystem::path const& path, bool create) {
  return std::make_unique<mpi_file>(path, create);
}

void mpi_comm::abort(int code) {
  MPI_Abort(state_->all, code);
  std::_Exit(code);
}

}  // namespace gart
