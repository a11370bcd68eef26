// Reads and writes checkpoints of a single rank, which has all rows.
#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/train/checkpoint_rows.hpp>

#include <ostream>

namespace gart {

namespace {

// A rank by itself writes its parts one after the other.
class stream_file final : public shared_file {
 public:
  explicit stream_file(std::ostream& out) : out_(out) {}
  void write(u64, void const* data, std::size_t bytes) override {
    out_.write(static_cast<char const*>(data), static_cast<std::streamsize>(bytes));
  }
  void close() override {}

 private:
  std::ostream& out_;
};

}  // namespace

void write_checkpoint(std::filesystem::path const& path, training_state const& state) {
  checkpoint_rows rows(state, {});
  rows.place(rows.bytes());
  write_file(path, [&](std::ostream& out) {
    stream_file file(out);
    rows.write(file, rows.checksum_shares());
  });
}

training_state read_checkpoint(std::filesystem::path const& path) {
  checkpoint_rows_reader const in(path, {});
  training_state state = in.state();
  in.require(in.checksum_shares());
  return state;
}

training_state read_checkpoint(std::filesystem::path const& path, int sh_degree) {
  training_state s = read_checkpoint(path);
  require_degree(path, s, sh_degree);
  return s;
}

void require_degree(std::filesystem::path const& path, training_state const& state, int sh_degree) {
  int const found = state.scene.sh_degree;
  if (found == sh_degree) return;
  throw io_error(path.string(),
                 "is of SH degree " + std::to_string(found) + ", this run of " + std::to_string(sh_degree) +
                     ": take configuration_request.sh_degree = " + std::to_string(found),
                 "take a checkpoint that was saved whole, or start anew");
}

void require_seed(std::filesystem::path const& path, training_state const& state, u64 seed) {
  if (state.seed != seed)
    throw io_error(path.string(), "is of seed " + std::to_string(state.seed) + ", this run of " + std::to_string(seed),
                   "take that seed: train_options.seed");
}

}  // namespace gart
