#include <gart/core/error.hpp>
#include <gart/io/file.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <system_error>

namespace gart {
namespace fs = std::filesystem;
namespace {

std::string reason(int code) { return code ? std::generic_category().message(code) : "the stream failed"; }

// Unlinks the temporary file unless it was renamed.
struct temporary_file {
  fs::path path;
  bool renamed = false;
  ~temporary_file() {
    std::error_code ignored;
    if (!renamed) fs::remove(path, ignored);
  }
};

// 0, or why the bytes of this file cannot be brought to the disk.
int sync_to_disk(fs::path const& path) {
  int const file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return errno;
  int const code = ::fsync(file) == 0 ? 0 : errno;
  ::close(file);
  return code == EINVAL ? 0 : code;  // file systems that cannot sync
}

}  // namespace

std::vector<u8> read_file(fs::path const& path) {
  std::error_code code;
  fs::file_status const status = fs::status(path, code);
  if (!fs::exists(status)) {
    throw io_error(
        path.string(),
        code && status.type() == fs::file_type::none ? "cannot be opened: " + code.message() : "there is no such file",
        "check the path");
  }
  if (fs::is_directory(status)) throw io_error(path.string(), "is a folder, not a file", "name a file in it");
  auto const size = fs::file_size(path, code);
  if (code) throw io_error(path.string(), "cannot be read: " + code.message(), "name a regular file");
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) throw io_error(path.string(), "cannot be opened: " + reason(errno), "check its permissions");
  std::vector<u8> bytes(size);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(in.gcount()) != size) {
    throw io_error(path.string(),
                   "only " + std::to_string(in.gcount()) + " of " + std::to_string(size) + " bytes could be read",
                   "check the disk, and that nothing is writing the file");
  }
  return bytes;
}

void write_file(fs::path const& path, std::function<void(std::ostream&)> const& body) {
  static std::atomic<unsigned> serial{0};
  if (!path.has_filename()) throw io_error(path.string(), "is not the name of a file", "add a file name");
  temporary_file temporary{path};
  temporary.path.replace_filename("." + path.filename().string() + "." + std::to_string(::getpid()) + "-" +
                                  std::to_string(serial++) + ".tmp");
  errno = 0;
  std::ofstream out(temporary.path, std::ios::binary | std::ios::trunc);
  if (!out) {
    throw io_error(path.string(), "cannot be created: " + reason(errno), "name a folder that exists and is writable");
  }
  auto const require = [&](bool good, int code) {
    if (!good) {
      throw io_error(path.string(), "cannot be written: " + reason(code),
                     "free some space or choose another folder; nothing was changed there");
    }
  };
  body(out);
  out.flush();
  require(out.good(), errno);
  out.close();
  require(out.good(), errno);
  int const code = sync_to_disk(temporary.path);
  require(code == 0, code);
  std::error_code rename_error;
  fs::rename(temporary.path, path, rename_error);
  if (rename_error) {
    throw io_error(path.string(), "cannot be replaced: " + rename_error.message(),
                   "remove what is there, or choose another name");
  }
  temporary.renamed = true;
}

void write_file(fs::path const& path, std::string_view bytes) {
  write_file(path, [bytes](std::ostream& out) { out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())); });
}

void write_file(fs::path const& path, std::vector<u8> const& bytes) {
  write_file(path, std::string_view(reinterpret_cast<char const*>(bytes.data()), bytes.size()));
}

}  // namespace gart
