#pragma once
// A PLY file in memory, its header read: its elements, their properties and encoding. What follows the header is not
// looked at.

#include <gart/comm/row_owners.hpp>
#include <gart/core/error.hpp>
#include <gart/core/types.hpp>
#include <gart/io/ply.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace gart::io::ply {

enum class encoding { ascii, little, big };
enum class scalar { i8, u8, i16, u16, i32, u32, f32, f64 };

constexpr std::size_t scalar_size(scalar type) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<int>(type)];
}

struct property {
  std::string name;
  scalar type = scalar::f32;
  bool list = false;
  scalar count_type = scalar::u8;
};

struct element {
  std::string name;
  u64 count = 0;
  std::vector<property> properties;
  // The least size of a record: bytes, or in ascii one digit and one separator a value.
  u64 smallest(encoding e) const {
    u64 bytes = 0;
    for (property const& p : properties)
      bytes += e == encoding::ascii ? 2 : scalar_size(p.list ? p.count_type : p.type);
    return bytes;
  }
};

struct header {
  encoding format = encoding::little;
  std::vector<element> elements;
  splat_traits traits;
  std::size_t size = 0;  // bytes
};

struct ply_file {
  std::string name;
  std::vector<u8> bytes;
  header head;
  row_owners owners = {};  // whose vertices the bytes are

  [[noreturn]] void refuse(std::string const& what, std::string const& remedy) const {
    throw io_error(name, what, remedy);
  }
};

// Refuses an element whose records need more than the bytes that are left, before any memory is taken.
inline void require_room(ply_file const& file, element const& e, u64 left) {
  u64 const smallest = e.smallest(file.head.format);
  u64 const room = left + (file.head.format == encoding::ascii);  // the last number needs no separator
  if (smallest && e.count > room / smallest)
    file.refuse("the header promises " + std::to_string(e.count) + " of '" + e.name + "', more than the " +
                    std::to_string(left) + " bytes that follow can hold",
                "the file is truncated: copy or export it again");
}

ply_file open(std::filesystem::path const& path);
// Reads the header and the owners' vertices of `total` in the file. Reads all vertices if their places are unknown.
ply_file open_rows(std::filesystem::path const& path, row_owners const& owners, u64& total);

// The first lines of a binary splat file of these traits, as comments. invalid_argument for one that is no line.
std::string header_start(std::filesystem::path const& path, splat_traits const& traits);

}  // namespace gart::io::ply
