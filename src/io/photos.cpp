// Which files the frames of a capture are of: photos by the names that its files give, masks beside them.

#include "capture.hpp"
#include "file_names.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <system_error>

namespace gart::io {
namespace fs = std::filesystem;

namespace {

// What images_4 is smaller by; 0 for images itself, and much for other names.
int order_of(std::string const& name) {
  if (name == "images") return 0;
  int factor = 0;
  if (name.starts_with("images_")) {
    auto const [end, code] = std::from_chars(name.data() + 7, name.data() + name.size(), factor);
    if (code == std::errc() && end == name.data() + name.size() && factor > 0) return std::min(factor, 1000);
  }
  return 1001;
}

fs::path folder_of_photos(fs::path const& photo) {
  fs::path folder = photo.parent_path();
  while (folder.has_filename() && !is_photo_folder(folder.filename().string())) folder = folder.parent_path();
  return folder.has_filename() ? folder : fs::path();
}

}  // namespace

std::vector<fs::path> photo_folders_in(fs::path const& capture) {
  std::vector<fs::path> folders;
  std::error_code code;
  for (fs::directory_iterator at(capture, code), end; !code && at != end; at.increment(code)) {
    std::error_code ignored;
    if (is_photo_folder(at->path().filename().string()) && at->is_directory(ignored)) folders.push_back(at->path());
  }
  std::sort(folders.begin(), folders.end(), [](fs::path const& a, fs::path const& b) {
    std::string const x = a.filename().string(), y = b.filename().string();
    return std::pair(order_of(x), x) < std::pair(order_of(y), y);
  });
  return folders;
}

place_beside beside_photos(fs::path const& photo, char const* name) {
  fs::path const folder = folder_of_photos(photo);
  if (folder.empty()) return {photo.parent_path() / name, photo.filename()};
  return {folder.parent_path() / name, photo.lexically_relative(folder)};
}

void find_photos(capture& c) {
  file_names names(c.photos);
  std::set<fs::path> taken;
  std::vector<std::pair<frame*, fs::path>> by_another_name;
  for (frame& f : c.frames) {
    auto const [file, as_named] = names.find(f.name);
    if (file.empty()) continue;
    if (as_named)
      f.photo = file, taken.insert(file);
    else
      by_another_name.emplace_back(&f, file);
  }
  // Two frames never share a photo, however similar their names.
  std::map<fs::path, int> wanted;
  for (auto const& [f, file] : by_another_name) ++wanted[file];
  std::size_t found = 0;
  std::string first;
  for (auto const& [f, file] : by_another_name) {
    if (taken.count(file) || wanted[file] > 1) continue;
    f->photo = file;
    if (found++ == 0) first = f->name + " is " + file.string();
  }
  if (found)
    c.notes.push_back(counted(found, "photo") + " found by another name: " + (found > 1 ? "first, " : "") + first);
}

void find_masks(capture& c) {
  for (frame const& f : c.frames)
    if (!f.mask.empty()) return;
  std::map<fs::path, file_names> folders;
  std::size_t found = 0;
  fs::path first;
  for (frame& f : c.frames) {
    if (f.photo.empty()) continue;
    for (char const* name : {"masks", "mask"}) {
      auto const [folder, below] = beside_photos(f.photo, name);
      std::error_code ignored;
      auto [place, added] = folders.try_emplace(folder, fs::is_directory(folder, ignored) ? folder : fs::path());
      // COLMAP's is NAME.png with the photo's own ending before it, others' are of the photo's name.
      f.mask = place->second.find(below.generic_string() + ".png").file;
      if (f.mask.empty()) f.mask = place->second.find(below.generic_string()).file;
      if (!f.mask.empty()) break;
    }
    if (!f.mask.empty() && found++ == 0) first = f.mask;
  }
  if (found)
    c.notes.push_back(std::to_string(found) + " of " + counted(c.frames.size(), "frame") + " have a mask, such as " +
                      first.string() + ": what is black there is ignored");
}

}  // namespace gart::io
