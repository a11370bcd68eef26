#include <gart/core/error.hpp>
#include <gart/io/splat_file.hpp>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>

namespace gart {

// Each format is defined with its reader.
extern splat_format const ply_format;

namespace {

splat_format const* const formats[] = {&ply_format};

std::string listed(bool written) {
  std::string all;
  for (auto const* format : formats)
    if (!written || format->write)
      all += std::string(all.empty() ? "" : ", ") + format->name + " (" + format->extension + ")";
  return all;
}

splat_format const* by_name(std::filesystem::path const& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (auto const* format : formats)
    if (ending == format->extension) return format;
  return nullptr;
}

// The name decides where the bytes say nothing, so that a damaged file is refused by its own format's reader.
splat_format const* format_of(std::filesystem::path const& path) {
  std::ifstream file(path, std::ios::binary);
  char first[16] = {};
  file.read(first, sizeof first);
  std::string_view const seen(first, static_cast<std::size_t>(file.gcount()));
  for (auto const* format : formats)
    if (format->begins(seen)) return format;
  if (auto const* named = by_name(path)) return named;
  return file.is_open() ? nullptr : formats[0];  // whose reader says what is wrong with the path
}

}  // namespace

span<splat_format const* const> splat_formats() { return {formats, std::size(formats)}; }

gaussian_model read_splats(std::filesystem::path const& path, splat_traits* traits) {
  splat_format const* const format = format_of(path);
  if (!format)
    throw io_error(path.string(), "is in no format of Gaussians that gart knows", "it reads " + listed(false));
  return format->read(path, traits);
}

void write_splats(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits) {
  splat_format const* const format = by_name(path);
  if (!format || !format->write)
    throw io_error(path.string(), "has the ending of no format of Gaussians that gart writes",
                   "it writes " + listed(true));
  format->write(path, model, traits);
}

}  // namespace gart
