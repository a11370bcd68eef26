#include "compression.hpp"

#include <zlib.h>
#if defined(GART_WITH_ZSTD)
#include <zstd.h>
#endif

#include <algorithm>
#include <limits>
#include <memory>
#include <thread>

namespace gart::io {

std::vector<u8> inflated(u8 const* bytes, std::size_t size, int window, std::size_t most, std::string const& file) {
  z_stream stream{};
  if (inflateInit2(&stream, window) != Z_OK) throw io_error(file, "cannot be inflated", "free some memory");
  std::unique_ptr<z_stream, int (*)(z_stream*)> const end(&stream, inflateEnd);
  std::vector<u8> out;
  std::size_t used = 0;
  int code = Z_OK;
  while (out.size() < most && code == Z_OK) {
    // In steps, so that a false count takes no more memory than the file holds.
    std::size_t const at = out.size();
    out.resize(std::min(most, at + std::max<std::size_t>(at, std::size_t{1} << 16)));
    stream.next_in = const_cast<Bytef*>(bytes + used);
    stream.avail_in = static_cast<uInt>(std::min<std::size_t>(size - used, std::numeric_limits<uInt>::max()));
    stream.next_out = out.data() + at;
    stream.avail_out = static_cast<uInt>(std::min<std::size_t>(out.size() - at, std::numeric_limits<uInt>::max()));
    uInt const in = stream.avail_in, room = stream.avail_out;
    code = inflate(&stream, Z_NO_FLUSH);
    used += in - stream.avail_in;
    out.resize(at + room - stream.avail_out);
    if (code != Z_OK && code != Z_STREAM_END) break;
    if (code == Z_OK && stream.avail_out == room && stream.avail_in == in) break;
  }
  if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR)
    throw io_error(file, std::string("cannot be inflated: ") + (stream.msg ? stream.msg : "damaged data"),
                   "the file is damaged: copy or export it again");
  return out;
}

std::vector<u8> zlib_stream(std::vector<u8> const& bytes, std::string const& file) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::vector<u8> out(size);
  if (compress(out.data(), &size, bytes.data(), static_cast<uLong>(bytes.size())) != Z_OK)
    throw io_error(file, "cannot be deflated", "free some memory");
  out.resize(size);
  return out;
}

std::vector<u8> gzipped(std::vector<u8> const& bytes, std::string const& file) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, gzip_window, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw io_error(file, "cannot be deflated", "free some memory");
  std::vector<u8> out;
  std::size_t used = 0;
  for (int code = Z_OK; code != Z_STREAM_END;) {
    std::size_t const at = out.size(), part = std::min<std::size_t>(bytes.size() - used, std::size_t{1} << 30);
    out.resize(at + (std::size_t{1} << 20));
    stream.next_in = const_cast<Bytef*>(bytes.data() + used), stream.avail_in = static_cast<uInt>(part);
    stream.next_out = out.data() + at, stream.avail_out = uInt{1} << 20;
    code = deflate(&stream, used + part == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    used += part - stream.avail_in;
    out.resize(out.size() - stream.avail_out);
  }
  deflateEnd(&stream);
  return out;
}

u32 zip_checksum(u8 const* bytes, std::size_t size) {
  uLong sum = crc32(0, nullptr, 0);
  for (std::size_t at = 0; at < size;) {
    std::size_t const part = std::min<std::size_t>(size - at, std::size_t{1} << 30);
    sum = crc32(sum, bytes + at, static_cast<uInt>(part));
    at += part;
  }
  return static_cast<u32>(sum);
}

#if defined(GART_WITH_ZSTD)

namespace {
// Level 12 is SPZ's own; on a million Gaussians each level more than this costs time and hardly any bytes less.
constexpr int level = 7;
}  // namespace

std::vector<u8> zstd_compressed(std::vector<u8> const& bytes, std::string const& file) {
  std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> const context(ZSTD_createCCtx(), ZSTD_freeCCtx);
  std::vector<u8> out(ZSTD_compressBound(bytes.size()));
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  // A library built without threads refuses these and compresses on one.
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_nbWorkers, static_cast<int>(std::thread::hardware_concurrency()));
  std::size_t const size = ZSTD_compress2(context.get(), out.data(), out.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size)) throw io_error(file, std::string("zstd: ") + ZSTD_getErrorName(size), "free some memory");
  out.resize(size);
  return out;
}

std::vector<u8> zstd_decompressed(u8 const* bytes, std::size_t packed, std::size_t size, std::string const& file) {
  std::vector<u8> out(size);
  std::size_t const got = ZSTD_decompress(out.data(), size, bytes, packed);
  if (ZSTD_isError(got) || got != size)
    throw io_error(file,
                   std::string("a stream cannot be decompressed: ") +
                       (ZSTD_isError(got) ? ZSTD_getErrorName(got) : "it is too short"),
                   "the file is damaged: copy or export it again");
  return out;
}

#else

std::vector<u8> zstd_compressed(std::vector<u8> const&, std::string const& file) {
  refuse_without(file, "SPZ of version 4", "zstd", "libzstd-dev");
}
std::vector<u8> zstd_decompressed(u8 const*, std::size_t, std::size_t, std::string const& file) {
  refuse_without(file, "SPZ of version 4", "zstd", "libzstd-dev");
}

#endif

}  // namespace gart::io
