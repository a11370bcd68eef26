#include "run_folder.hpp"

#include "output.hpp"

#include <gart/core/error.hpp>

#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gart_cli {

namespace fs = std::filesystem;

namespace {

// The images alone: what else a user keeps in renders/ is none of a run's.
std::vector<fs::path> images_in(fs::path const& folder) {
  std::vector<fs::path> images;
  std::error_code failure;
  for (fs::directory_iterator it(folder, failure), end; !failure && it != end; it.increment(failure))
    if (it->path().extension() == ".png") images.push_back(it->path());
  return images;
}

bool is_run(fs::path const& folder) {
  std::string magic(16, '\0');
  std::ifstream checkpoint(folder / "checkpoint.gart", std::ios::binary);
  checkpoint.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (magic == "gart checkpoint ") return true;
  if (!fs::exists(folder / "config.json")) return false;
  try {
    nlohmann::json const config = read_json(folder / "config.json");
    return config.is_object() && config.contains("gart") && config.contains("options");
  } catch (gart::io_error const&) {
    return false;
  }
}

}  // namespace

std::string background_of_run(fs::path const& model) {
  fs::path const folder = model.parent_path();
  if (!is_run(folder) || !fs::exists(folder / "config.json")) return {};
  nlohmann::json const config = read_json(folder / "config.json");
  if (!config.is_object() || !config.contains("chosen") || !config["chosen"].is_array()) return {};
  for (auto const& choice : config["chosen"])
    if (choice.is_object() && choice.value("option", nlohmann::json()) == "--background" &&
        choice.value("value", nlohmann::json()).is_string())
      return choice["value"];
  return {};
}

run_lock::run_lock(fs::path const& folder) : file_(folder / ".gart.lock") {
  for (;;) {
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor_ < 0) return;
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      bool const held = errno == EWOULDBLOCK;
      char holder[32] = {};
      bool const named = ::pread(descriptor_, holder, sizeof holder - 1, 0) > 0;
      ::close(descriptor_);
      descriptor_ = -1;
      if (!held) return;  // a file system without locks
      throw gart::io_error(
          folder.string(),
          "another gart train" + (named ? " (process " + std::string(holder) + ")" : "") + " is writing there",
          "wait until it is done, or choose another --out");
    }
    // The one that held it may have removed the file since it was opened: then another would lock another file.
    struct stat ours = {}, there = {};
    if (::fstat(descriptor_, &ours) == 0 && ::stat(file_.c_str(), &there) == 0 && ours.st_ino == there.st_ino &&
        ours.st_dev == there.st_dev)
      break;
    ::close(descriptor_);
  }
  std::string const process = std::to_string(::getpid());
  bool const written = ::ftruncate(descriptor_, 0) == 0 &&
                       ::pwrite(descriptor_, process.data(), process.size(), 0) == static_cast<ssize_t>(process.size());
  static_cast<void>(written);  // a full disk: the lock holds without its name
}

run_lock::~run_lock() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());
  ::close(descriptor_);
}

void refuse_foreign_files(fs::path const& folder) {
  if (is_run(folder)) return;
  auto const refuse = [](fs::path const& file) {
    throw gart::io_error(file.string(), "is there, from no run of gart train, and this run would replace it",
                         "choose another --out, or move it away");
  };
  for (char const* name : {"model.ply", "config.json", "checkpoint.gart", "history.json", "metrics.json", "report.html",
                           "exposures.json", "poses.json", "poses_test.json"})
    if (fs::exists(folder / name)) refuse(folder / name);
  for (auto const& image : images_in(folder / "renders")) refuse(image);
}

void remove_temporary_files(fs::path const& folder) {
  for (fs::path const& of : {folder, folder / "renders"}) {
    std::error_code code;
    std::vector<fs::path> begun;
    for (fs::directory_iterator at(of, code), end; !code && at != end; at.increment(code)) {
      // As write_file names them: .NAME.PROCESS-NUMBER.tmp
      std::string const name = at->path().filename().string();
      if (!name.starts_with('.') || !name.ends_with(".tmp")) continue;
      std::string const middle = name.substr(0, name.size() - 4), number = middle.substr(middle.rfind('.') + 1);
      bool const ours = number.find('-') != number.npos && number.find_first_not_of("0123456789-") == number.npos;
      if (ours && at->is_regular_file(code)) begun.push_back(at->path());
    }
    for (fs::path const& file : begun) fs::remove(file, code);
  }
}

void remove_results(fs::path const& folder) {
  for (char const* name : {"metrics.json", "report.html", "poses_test.json"}) fs::remove(folder / name);
  for (auto const& image : images_in(folder / "renders")) fs::remove(image);
}

void remove_run(fs::path const& folder) {
  remove_results(folder);
  for (char const* name : {"model.ply", "exposures.json", "poses.json", "checkpoint.gart", "history.json"})
    fs::remove(folder / name);
}

}  // namespace gart_cli
