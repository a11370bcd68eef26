#pragma once
// Bytes made smaller and larger again by zlib and zstd. `file` is named in errors.

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>

#include <string>
#include <vector>

namespace gart::io {

// zlib's word for a gzip file, and for a stream without any header, as in a zip file.
inline constexpr int gzip_window = 16 + 15, raw_window = -15;

// The first unpacked bytes, at most `most`.
std::vector<u8> inflated(u8 const* bytes, std::size_t size, int window, std::size_t most, std::string const& file);
// A stream with zlib's header.
std::vector<u8> zlib_stream(std::vector<u8> const& bytes, std::string const& file);
// A gzip file.
std::vector<u8> gzipped(std::vector<u8> const& bytes, std::string const& file);
u32 zip_checksum(u8 const* bytes, std::size_t size);

// One frame of zstd, and the `size` bytes in one. io_error naming the package, where gart was built without zstd.
std::vector<u8> zstd_compressed(std::vector<u8> const& bytes, std::string const& file);
std::vector<u8> zstd_decompressed(u8 const* bytes, std::size_t packed, std::size_t size, std::string const& file);

// A package that a format needs and this build lacks.
[[noreturn]] inline void refuse_without(std::string const& file, char const* format, char const* library,
                                        char const* package) {
  throw io_error(file, std::string(format) + " needs " + library + ", which this build of gart lacks",
                 std::string("install ") + package + " (Debian, Ubuntu) and build gart again, or name another format");
}

}  // namespace gart::io
