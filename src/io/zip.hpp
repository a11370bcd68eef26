#pragma once
// Zip files: entries by name, stored or deflated. Data that is compressed already is stored. No encryption, no archives
// of several parts or past 4 GB. https://pkware.cachefly.net/webdocs/APPNOTE/APPNOTE-6.3.9.TXT

#include <gart/core/types.hpp>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace gart::io {

class zip_reader {
 public:
  // Reads the directory. The bytes must outlive the reader.
  zip_reader(std::vector<u8> const& bytes, std::string file);
  // An entry, wherever in the archive's folders a name that ends so stands; at most `most` bytes, else io_error.
  std::vector<u8> get(std::string const& name, std::size_t most) const;
  // Of all entries, in order.
  std::vector<std::string> names() const;

 private:
  struct entry {
    u16 method;
    u64 packed, size, at;
    u32 checksum;
  };
  std::vector<u8> const& bytes_;
  std::string file_;
  std::map<std::string, entry> entries_;
};

// The bytes of an archive of these entries.
std::string zip_of(std::vector<std::pair<std::string, std::vector<u8>>> const& entries, std::string const& file);

}  // namespace gart::io
