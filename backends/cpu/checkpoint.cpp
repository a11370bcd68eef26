#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/train/checkpoint.hpp>

#include <cstring>
#include <ostream>

namespace gart {

namespace {

constexpr char magic[] = "gart checkpoint 1\n";
constexpr std::size_t magic_size = sizeof magic - 1;
constexpr u64 longest_name = 256;

void put(std::ostream& out, u64 value) { out.write(reinterpret_cast<char const*>(&value), sizeof value); }

void put_array(std::ostream& out, std::string const& name, std::vector<char> const& bytes) {
  put(out, name.size());
  out.write(name.data(), static_cast<std::streamsize>(name.size()));
  put(out, bytes.size());
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

void checkpoint_writer::write(std::filesystem::path const& path) const {
  write_file(path, [this](std::ostream& out) {
    out.write(magic, magic_size);
    for (auto const& [name, bytes] : arrays_) put_array(out, name, bytes);
    put_array(out, "end", {});
  });
}

checkpoint_reader::checkpoint_reader(std::filesystem::path const& path) : path_(path) {
  std::vector<u8> const file = read_file(path);
  std::size_t at = magic_size;
  if (file.size() < magic_size || std::memcmp(file.data(), magic, magic_size) != 0) fail("is not a gart checkpoint");
  auto const take = [&](void* to, std::size_t bytes) {
    if (file.size() - at < bytes) fail("is truncated: the last complete array is its last readable part");
    if (bytes) std::memcpy(to, file.data() + at, bytes);
    at += bytes;
  };
  for (;;) {
    u64 length = 0, bytes = 0;
    take(&length, sizeof length);
    if (length > longest_name) fail("is damaged: an array's name is too long");
    std::string name(length, '\0');
    take(name.data(), length);
    take(&bytes, sizeof bytes);
    if (bytes > file.size()) fail("is truncated or damaged: array " + name + " is longer than the file");
    std::vector<char> data(bytes);
    take(data.data(), bytes);
    if (name == "end") break;
    arrays_[name] = std::move(data);
  }
}

void checkpoint_reader::fail(std::string const& what) const {
  throw io_error(path_.string(), what, "start again without --resume, or give the folder of a run that was saved");
}

std::vector<char> const& checkpoint_reader::find(std::string const& name, std::size_t element) const {
  auto const it = arrays_.find(name);
  if (it == arrays_.end()) fail("has no array " + name);
  if (it->second.size() % element != 0) fail("array " + name + " is not a whole number of elements");
  return it->second;
}

}  // namespace gart
