#include "checkpoint_arrays.hpp"

#include <gart/core/error.hpp>
#include <gart/io/crc32c.hpp>
#include <gart/io/file.hpp>
#include <gart/runtime/checkpoint.hpp>
#include <gart/train/state.hpp>

#include <cstring>
#include <ostream>

namespace gart {

using namespace io::checkpoint;

namespace {

class array_writer {
 public:
  explicit array_writer(std::ostream& out) : out_(out) {}
  void write(std::string const& name, checkpoint_array const& array) {
    crc_ = 0;
    number<u64>(name.size());
    put(name.data(), name.size());
    number<u32>(array.version);
    number<u64>(array.bytes.size());
    put(array.bytes.data(), array.bytes.size());
    number<u32>(crc_);
  }

 private:
  template <class T>
  void number(T value) {
    put(reinterpret_cast<char const*>(&value), sizeof value);
  }
  void put(char const* bytes, std::size_t size) {
    out_.write(bytes, static_cast<std::streamsize>(size));
    crc_ = crc32c(bytes, size, crc_);
  }
  std::ostream& out_;
  u32 crc_ = 0;
};

}  // namespace

void checkpoint_writer::write(std::filesystem::path const& path) const {
  write_file(path, [this](std::ostream& out) {
    out.write(magic, magic_size);
    array_writer writer(out);
    for (auto const& [name, array] : arrays_) writer.write(name, array);
    writer.write("end", {});
  });
}

checkpoint_reader::checkpoint_reader(std::filesystem::path const& path) : path_(path) {
  std::vector<u8> const file = read_file(path);
  std::size_t at = magic_size;
  auto const starts = [&](char const* with) {
    return file.size() >= magic_size && std::memcmp(file.data(), with, magic_size) == 0;
  };
  bool const checked = starts(magic);
  if (!checked && !starts(plain_magic)) fail("is not a gart checkpoint");
  auto const take = [&](void* to, std::size_t bytes) {
    if (file.size() - at < bytes) fail("is truncated: the last complete array is its last readable part");
    if (bytes) std::memcpy(to, file.data() + at, bytes);
    at += bytes;
  };
  for (;;) {
    std::size_t const begin = at;
    u64 length = 0, bytes = 0;
    checkpoint_array array;
    take(&length, sizeof length);
    if (length > longest_name) fail("is damaged: an array's name is too long");
    std::string name(length, '\0');
    take(name.data(), length);
    if (checked) take(&array.version, sizeof array.version);
    take(&bytes, sizeof bytes);
    if (bytes > file.size()) fail("is truncated or damaged: array " + name + " is longer than the file");
    array.bytes.resize(bytes);
    take(array.bytes.data(), bytes);
    if (checked) {
      u32 const found = crc32c(file.data() + begin, at - begin);
      u32 stored = 0;
      take(&stored, sizeof stored);
      if (found != stored) fail("is damaged: the checksum of array " + name + " is not that of its bytes");
    }
    if (name == "end") break;
    arrays_[name] = std::move(array);
  }
  if (checked && at != file.size()) fail("is damaged: there is more after its end");
}

void checkpoint_reader::fail(std::string const& what) const {
  throw io_error(path_.string(), what, "take a checkpoint that was saved whole, or start anew");
}

std::vector<char> const& checkpoint_reader::find(std::string const& name, std::size_t element,
                                                 u32 newest_version) const {
  auto const it = arrays_.find(name);
  if (it == arrays_.end()) fail("has no array " + name);
  auto const& [version, bytes] = it->second;
  if (version > newest_version) {
    fail("array " + name + " is of version " + std::to_string(version) + ", and this program reads up to " +
         std::to_string(newest_version) + ": a newer gart wrote it");
  }
  if (bytes.size() % element != 0) fail("array " + name + " is not a whole number of elements");
  return bytes;
}

training_state without_rows(training_state const& state) {
  training_state out;
  out.origin = state.origin, out.step = state.step, out.growth = state.growth, out.seed = state.seed;
  out.exposures = state.exposures, out.vignetting = state.vignetting, out.poses = state.poses,
  out.lenses = state.lenses;
  return out;
}

void write_checkpoint(std::filesystem::path const& path, training_state const& state) {
  checkpoint_writer out;
  for_each_state_array(state, [&](std::string const& name, auto const& values, std::size_t) { out.add(name, values); });
  out.write(path);
}

training_state read_checkpoint(std::filesystem::path const& path) { return state_of(checkpoint_reader(path)); }

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

}  // namespace gart
