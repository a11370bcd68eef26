#pragma once
// One resolver for the names of photos, masks and depth maps in captures. Programs may have written them for another
// system, folder, case or extension than the disk's.

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace gart::io {

// With slashes, and without `.` and what `..` takes back.
std::string plain_name(std::string name);

// Whether a folder of a capture is one of photos: images, images_4, input.
bool is_photo_folder(std::string const& name);

class file_names {
 public:
  // Files below a folder. Files with these extensions are also found by differing names.
  explicit file_names(std::filesystem::path folder,
                      std::initializer_list<std::string_view> extensions = {".png", ".jpg", ".jpeg", ".webp"})
      : folder_(std::move(folder)), extensions_(extensions) {}

  struct match {
    std::filesystem::path file;  // empty: none, or several alike
    bool as_named = false;       // but for an extension that the name lacks
  };
  // The file of that name. Else one whose name differs by case, a photo's extension, folders before it, or another
  // folder of photos.
  match find(std::string const& name);

  std::filesystem::path const& folder() const { return folder_; }
  std::size_t size();
  // The file whose name is least different; empty without one.
  std::string nearest(std::string const& name);

 private:
  void list();
  std::string without_extension(std::string const& name) const;

  std::filesystem::path folder_;
  std::vector<std::string_view> extensions_;
  bool listed_ = false;
  std::multimap<std::string, std::string> paths_;  // below the folder, by the last part: lower case, no extension
};

}  // namespace gart::io
