#include "ply_header.hpp"

#include "bytes.hpp"

#include <gart/io/file.hpp>

#include <algorithm>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

namespace gart::io::ply {

namespace {

scalar scalar_named(ply_file const& file, std::string_view name) {
  static constexpr std::pair<std::string_view, scalar> names[] = {
      {"char", scalar::i8},   {"int8", scalar::i8},     {"uchar", scalar::u8},   {"uint8", scalar::u8},
      {"short", scalar::i16}, {"int16", scalar::i16},   {"ushort", scalar::u16}, {"uint16", scalar::u16},
      {"int", scalar::i32},   {"int32", scalar::i32},   {"uint", scalar::u32},   {"uint32", scalar::u32},
      {"float", scalar::f32}, {"float32", scalar::f32}, {"double", scalar::f64}, {"float64", scalar::f64}};
  for (auto const& [known, type] : names) {
    if (known == name) return type;
  }
  file.refuse("the header has a property of type '" + std::string(name.substr(0, 40)) + "'",
              "PLY has no such type: export it again");
}

void parse_header(ply_file& file) {
  std::string_view const all(reinterpret_cast<char const*>(file.bytes.data()), file.bytes.size());
  std::string_view rest = all, line;
  char const* const again = "the file is damaged: export it again";
  if (!next_line(rest, line) || line != "ply") file.refuse("does not begin with 'ply'", "name a PLY file");
  bool has_format = false, filtered = false;
  while (next_line(rest, line)) {
    std::string_view const whole = line;
    std::string_view const key = next_word(line);
    if (key == "end_header") {
      if (!has_format) file.refuse("the header has no format line", again);
      if (filtered) file.head.traits.try_emplace("antialias", "");
      file.head.size = all.size() - rest.size();
      return;
    }
    if (key == "format") {
      std::string_view const kind = next_word(line), version = next_word(line);
      if (version != "1.0") file.refuse("the format is not version 1.0", "export it again");
      if (kind == "ascii")
        file.head.format = encoding::ascii;
      else if (kind == "binary_little_endian")
        file.head.format = encoding::little;
      else if (kind == "binary_big_endian")
        file.head.format = encoding::big;
      else
        file.refuse("the format '" + std::string(kind.substr(0, 40)) + "' is not one of PLY's", "export it again");
      has_format = true;
    } else if (key == "comment") {
      std::string_view const whose = next_word(line);
      if (whose == "SplatRenderMode:") filtered = next_word(line) == "mip";
      if (whose == "antialiased") filtered = next_word(line) == "1";
      if (whose != "gart") continue;
      std::string const name(next_word(line));
      while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
      if (!name.empty()) file.head.traits[name] = std::string(line);
    } else if (key == "element") {
      element e;
      e.name = next_word(line);
      if (e.name.empty() || !parse_number(next_word(line), e.count)) {
        file.refuse("the header has the line '" + std::string(whole.substr(0, 60)) + "', without a count", again);
      }
      file.head.elements.push_back(std::move(e));
    } else if (key == "property") {
      if (file.head.elements.empty()) file.refuse("the header has a property before any element", again);
      property p;
      std::string_view type = next_word(line);
      if (type == "list") {
        p.list = true;
        p.count_type = scalar_named(file, next_word(line));
        type = next_word(line);
        if (p.count_type == scalar::f32 || p.count_type == scalar::f64)
          file.refuse("a list's length is not an integer", again);
      }
      p.type = scalar_named(file, type);
      p.name = next_word(line);
      if (p.name.empty()) file.refuse("the header has a property without a name", again);
      file.head.elements.back().properties.push_back(std::move(p));
    } else if (!key.empty() && key != "obj_info") {
      file.refuse("the header has the line '" + std::string(whole.substr(0, 60)) + "'", again);
    }
  }
  file.refuse("ends within the header", "the file is truncated: copy or export it again");
}

}  // namespace

ply_file open(std::filesystem::path const& path) {
  ply_file file{path.string(), read_file(path), {}};
  parse_header(file);
  return file;
}

ply_file open_rows(std::filesystem::path const& path, row_owners const& owners, u64& total) {
  // The header is in the first bytes, or in more of them.
  std::ifstream in(path, std::ios::binary);
  std::error_code code;
  u64 const size = std::filesystem::file_size(path, code);
  if (!in || code || std::filesystem::is_directory(path, code)) return open(path);  // which says what is wrong
  ply_file file{path.string(), {}, {}};
  for (u64 most = u64{1} << 16;; most *= 2) {
    file.bytes.resize(std::min(most, size));
    in.seekg(0);
    in.read(reinterpret_cast<char*>(file.bytes.data()), static_cast<std::streamsize>(file.bytes.size()));
    std::string_view const start(reinterpret_cast<char const*>(file.bytes.data()), file.bytes.size());
    if (most >= size || start.find("\nend_header\n") != start.npos || start.find("\nend_header\r") != start.npos) break;
  }
  parse_header(file);
  u64 before = file.head.size, record = 0;
  bool whole = file.head.format == encoding::ascii;
  auto vertices = file.head.elements.begin();
  for (; vertices != file.head.elements.end(); ++vertices) {
    // Means in double have an origin by all of them.
    for (property const& p : vertices->properties) whole = whole || p.list || (p.name == "x" && p.type == scalar::f64);
    record = vertices->smallest(file.head.format);
    if (vertices->name == "vertex") break;
    whole = whole || (record != 0 && vertices->count > size / record);
    before += vertices->count * record;
  }
  if (whole || vertices == file.head.elements.end() || before > size || record == 0 ||
      vertices->count > (size - before) / record) {
    ply_file all = open(path);  // what is wrong is said where it is read
    for (element const& e : all.head.elements)
      if (e.name == "vertex") total = e.count;
    return all;
  }
  total = vertices->count;
  file.owners = owners;
  element mine = *vertices;
  mine.count = owners.owned(total);
  file.head.elements = {mine};
  file.bytes.resize(file.head.size + mine.count * record);
  owners.for_each_run(total, [&](u64 first, u64 count, u64 row) {
    in.seekg(static_cast<std::streamoff>(before + first * record));
    in.read(reinterpret_cast<char*>(file.bytes.data() + file.head.size + row * record),
            static_cast<std::streamsize>(count * record));
  });
  if (!in) file.refuse("cannot be read", "check the disk, and that nothing is writing the file");
  return file;
}

std::string header_start(std::filesystem::path const& path, splat_traits const& traits) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  for (auto const& [key, value] : traits) {
    bool const word = !key.empty() && std::none_of(key.begin(), key.end(), is_space);
    if (!word || value.find_first_of("\r\n") != std::string::npos) {
      throw invalid_argument("the trait '" + key + "' does not fit on a comment line of " + path.string());
    }
    text += "comment gart " + key + " " + value + "\n";
  }
  if (traits.count("antialias")) text += "comment SplatRenderMode: mip\n";
  return text;
}

}  // namespace gart::io::ply
