#include "zip.hpp"

#include "bytes.hpp"
#include "compression.hpp"

#include <algorithm>

namespace gart::io {

namespace {

constexpr u32 local_mark = 0x04034b50, directory_mark = 0x02014b50, end_mark = 0x06054b50;
constexpr std::size_t end_size = 22, longest_comment = 65535;
constexpr u16 version = 20, utf_8 = 0x800, stored = 0, deflated = 8;
constexpr u16 no_time = 0, first_day = 0x21;  // 1 January 1980: the same model gives the same bytes

}  // namespace

zip_reader::zip_reader(std::vector<u8> const& bytes, std::string file) : bytes_(bytes), file_(std::move(file)) {
  auto const refuse = [&](char const* what) {
    throw io_error(file_, what, "the file is truncated or damaged: copy or export it again");
  };
  // The end of the directory is found from the back, before a comment of any length.
  if (bytes.size() < end_size) refuse("is too short for a zip file");
  std::size_t end = bytes.size() - end_size;
  std::size_t const least = end - std::min(end, longest_comment);
  auto const mark_at = [&](std::size_t at) {
    u32 mark;
    std::memcpy(&mark, bytes.data() + at, sizeof mark);
    return mark;
  };
  while (mark_at(end) != end_mark) {
    if (end == least) refuse("has no end of a zip file's directory");
    --end;
  }
  byte_reader in(bytes, file_);
  in.skip(end + 10, "the directory");
  u16 const count = in.get<u16>("the directory");
  in.skip(4, "the directory");
  u32 const start = in.get<u32>("the directory");
  byte_reader directory(bytes, file_);
  directory.skip(start, "the directory");
  for (u16 i = 0; i < count; ++i) {
    if (directory.get<u32>("the directory") != directory_mark) refuse("has a directory that is none");
    directory.skip(4, "the directory");
    entry e{};
    u16 const flags = directory.get<u16>("the directory");
    e.method = directory.get<u16>("the directory");
    directory.skip(4, "the directory");
    e.checksum = directory.get<u32>("the directory");
    e.packed = directory.get<u32>("the directory"), e.size = directory.get<u32>("the directory");
    u16 const name = directory.get<u16>("the directory"), extra = directory.get<u16>("the directory"),
              comment = directory.get<u16>("the directory");
    directory.skip(8, "the directory");
    u32 const local = directory.get<u32>("the directory");
    std::string text;
    for (u16 c = 0; c < name; ++c) text += static_cast<char>(directory.get<u8>("the name of an entry"));
    directory.skip(u64{extra} + comment, "the directory");
    if (flags & 1) refuse("has an encrypted entry");
    byte_reader head(bytes, file_);
    head.skip(u64{local} + 26, "an entry");
    u64 const skipped = u64{head.get<u16>("an entry")} + head.get<u16>("an entry");
    e.at = u64{local} + 30 + skipped;
    if (e.at > bytes.size() || e.packed > bytes.size() - e.at) refuse("ends within an entry");
    entries_[text] = e;
  }
}

std::vector<u8> zip_reader::get(std::string const& name, std::size_t most) const {
  for (auto const& [path, e] : entries_) {
    if (!(path == name || path.ends_with("/" + name))) continue;
    auto const refuse = [&, &entry_path = path](std::string const& what) {
      throw io_error(file_, "the entry " + entry_path + " " + what,
                     "the file is damaged or of another program: export it again");
    };
    if (e.size > most) refuse("is larger than belongs there, " + std::to_string(e.size) + " bytes");
    std::vector<u8> out;
    if (e.method == stored)
      out.assign(bytes_.begin() + static_cast<std::ptrdiff_t>(e.at),
                 bytes_.begin() + static_cast<std::ptrdiff_t>(e.at + e.packed));
    else if (e.method == deflated)
      out = inflated(bytes_.data() + e.at, e.packed, raw_window, e.size, file_);
    else
      refuse("is compressed in a way that gart does not read");
    if (out.size() != e.size || zip_checksum(out.data(), out.size()) != e.checksum) refuse("is damaged");
    return out;
  }
  throw io_error(file_, "has no entry " + name, "export it again");
}

std::vector<std::string> zip_reader::names() const {
  std::vector<std::string> all;
  for (auto const& entry : entries_) all.push_back(entry.first);
  return all;
}

std::string zip_of(std::vector<std::pair<std::string, std::vector<u8>>> const& entries, std::string const& file) {
  std::string out, directory;
  for (auto const& [name, bytes] : entries) {
    u64 const at = out.size();
    if (at + bytes.size() > 0xf0000000u)
      throw io_error(file, "would be larger than the 4 GB of a zip file", "keep fewer Gaussians");
    std::string shared;  // of the entry's head and its line in the directory
    for (u16 const v : {version, utf_8, stored, no_time, first_day}) put(shared, v);
    put(shared, zip_checksum(bytes.data(), bytes.size()));
    put(shared, static_cast<u32>(bytes.size()));
    put(shared, static_cast<u32>(bytes.size()));
    put(shared, static_cast<u16>(name.size()));
    put(shared, u16{0});
    put(out, local_mark);
    out += shared + name;
    out.append(reinterpret_cast<char const*>(bytes.data()), bytes.size());
    put(directory, directory_mark);
    put(directory, version);
    directory += shared;
    directory.append(10, '\0');  // no comment, first part, no attributes
    put(directory, static_cast<u32>(at));
    directory += name;
  }
  u32 const start = static_cast<u32>(out.size());
  out += directory;
  put(out, end_mark);
  put(out, u32{0});
  for (int i = 0; i < 2; ++i) put(out, static_cast<u16>(entries.size()));
  put(out, static_cast<u32>(directory.size()));
  put(out, start);
  put(out, u16{0});
  return out;
}

}  // namespace gart::io
