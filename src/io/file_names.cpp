#include "file_names.hpp"

#include <gart/core/words.hpp>

#include <algorithm>
#include <system_error>

namespace gart::io {
namespace fs = std::filesystem;

namespace {

constexpr int deepest = 6;
constexpr std::size_t most_files = 1'000'000, most_compared = 20'000;

std::string last_part(std::string const& path) { return path.substr(path.rfind('/') + 1); }

// From the last to the first.
std::vector<std::string> parts_of(std::string const& path) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= path.size();) {
    std::size_t const end = std::min(path.find('/', begin), path.size());
    if (end > begin) parts.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  std::reverse(parts.begin(), parts.end());
  return parts;
}

// The number of equal parts of two paths, counted from the end, if only photos' folders remain of one.
std::size_t alike(std::vector<std::string> const& a, std::vector<std::string> const& b) {
  std::size_t n = 0;
  while (n < std::min(a.size(), b.size()) && a[n] == b[n]) ++n;
  bool const whole = n == std::min(a.size(), b.size());
  return whole || (is_photo_folder(a[n]) && is_photo_folder(b[n])) ? n : 0;
}

// Folders that hold what photos are not.
bool is_passed_over(std::string const& name) {
  std::string const n = lower(name);
  return n.starts_with(".") || n.starts_with("mask") || n.starts_with("depth") || n.starts_with("normal") ||
         n == "sparse" || n == "renders";
}

}  // namespace

std::string plain_name(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return fs::path(name).lexically_normal().generic_string();
}

bool is_photo_folder(std::string const& name) {
  std::string const n = lower(name);
  return n == "images" || n == "input" || n == "image" || n.starts_with("images_");
}

std::string file_names::without_extension(std::string const& name) const {
  std::string const n = lower(name);
  for (std::string_view const extension : extensions_)
    if (n.size() > extension.size() && n.ends_with(extension)) return n.substr(0, n.size() - extension.size());
  return n;
}

void file_names::list() {
  if (listed_) return;
  listed_ = true;
  std::error_code code;
  fs::recursive_directory_iterator at(
      folder_, fs::directory_options::follow_directory_symlink | fs::directory_options::skip_permission_denied, code);
  for (; !code && at != fs::recursive_directory_iterator() && paths_.size() < most_files; at.increment(code)) {
    std::error_code ignored;
    std::string const name = at->path().filename().string();
    if (at->is_directory(ignored)) {
      if (at.depth() >= deepest || is_passed_over(name)) at.disable_recursion_pending();
    } else if (std::string const stem = without_extension(name); stem.size() < name.size()) {
      paths_.emplace(stem, at->path().lexically_relative(folder_).generic_string());
    }
  }
}

file_names::match file_names::find(std::string const& name) {
  if (name.empty() || folder_.empty()) return {};
  std::error_code ignored;
  std::string const plain = plain_name(name);
  fs::path const file = (folder_ / fs::path(plain)).lexically_normal();
  if (fs::is_regular_file(file, ignored)) return {file, true};
  for (std::string_view const extension : extensions_) {
    fs::path with = file;
    with += extension;
    if (fs::is_regular_file(with, ignored)) return {with, true};
  }
  list();
  std::string const stem = without_extension(last_part(plain));
  auto parts = parts_of(lower(plain));
  if (parts.empty()) return {};
  parts[0] = stem;
  std::string best;
  std::size_t most = 0;
  bool several = false;
  auto const [begin, end] = paths_.equal_range(stem);
  for (auto it = begin; it != end; ++it) {
    auto theirs = parts_of(lower(it->second));
    // The name with its extension counts as half a part more.
    bool const same_extension = theirs[0] == lower(last_part(plain));
    theirs[0] = stem;
    std::size_t const score = alike(parts, theirs) * 2;
    if (score == 0 || score + same_extension < most) continue;
    several = score + same_extension == most;
    most = score + same_extension, best = it->second;
  }
  return most == 0 || several ? match{} : match{folder_ / best, false};
}

std::size_t file_names::size() {
  list();
  return paths_.size();
}

std::string file_names::nearest(std::string const& name) {
  list();
  std::string const wanted = lower(last_part(plain_name(name))).substr(0, 256);
  std::string best;
  std::size_t least = 0, compared = 0;
  for (auto const& [stem, path] : paths_) {
    if (++compared > most_compared) break;
    std::size_t const changed = letters_between(wanted, lower(last_part(path)).substr(0, 256));
    if (best.empty() || changed < least) best = path, least = changed;
  }
  return best;
}

}  // namespace gart::io
