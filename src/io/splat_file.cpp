#include "bulk.hpp"
#include "capture.hpp"

#include <gart/core/error.hpp>
#include <gart/core/words.hpp>
#include <gart/io/ply.hpp>
#include <gart/io/splat_file.hpp>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace gart {

// Each format is defined with its reader.
extern splat_format const ply_format, compressed_ply_format, spz_format, sog_format, splat_bytes_format, glb_format;

namespace {

splat_format const* const formats[] = {&compressed_ply_format, &ply_format, &spz_format, &sog_format,
                                       &splat_bytes_format,    &glb_format};

std::string listed(bool written) {
  std::vector<splat_format const*> all(std::begin(formats), std::end(formats));
  std::erase_if(all, [&](splat_format const* format) { return written && !format->write; });
  return joined(all, [](splat_format const* f) { return std::string(f->name) + " (" + f->extension + ")"; });
}

splat_format const* by_name(std::filesystem::path const& path) {
  std::string const name = lower(path.filename().string());
  for (auto const* format : formats)
    if (name.ends_with(format->extension)) return format;
  return nullptr;
}

// The name decides where the bytes say nothing, so that a damaged file is refused by its own format's reader.
splat_format const* format_of(std::filesystem::path const& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    return std::filesystem::exists(path / "meta.json", ignored) ? &sog_format : nullptr;
  if (path.filename() == "meta.json") return &sog_format;
  std::ifstream file(path, std::ios::binary);
  char first[4096] = {};
  file.read(first, sizeof first);
  std::string_view const seen(first, static_cast<std::size_t>(file.gcount()));
  for (auto const* format : formats)
    if (format->begins && format->begins(seen)) return format;
  if (auto const* named = by_name(path)) return named;
  return file.is_open() ? nullptr : &ply_format;  // whose reader says what is wrong with the path
}

// Says what a path in no format is, and which path may have been meant.
[[noreturn]] void refuse_path(std::filesystem::path const& path) {
  std::error_code ignored;
  std::filesystem::path const trained = path / "model.ply";
  bool const capture = io::holds_capture(path), training = io::holds_training(path);
  if (training && std::filesystem::exists(trained, ignored))
    throw io_error(path.string(), "is the folder of a training", "name " + trained.string());
  if (training)
    throw io_error(path.string(), "is the folder of a training that has left no model.ply yet",
                   "resume the training, which ends with one");
  if (capture || path.extension() == ".json")
    throw io_error(path.string(),
                   capture ? "is a capture, where a model is wanted" : "is JSON, where a model is wanted",
                   "name a model.ply; the two may be swapped, for the model comes first");
  throw io_error(path.string(), "is in no format of Gaussians that gart knows", "it reads " + listed(false));
}

splat_format const& written_as(std::filesystem::path const& path) {
  splat_format const* const format = by_name(path);
  if (!format || !format->write)
    throw io_error(path.string(), "has the ending of no format of Gaussians that gart writes",
                   "it writes " + listed(true));
  return *format;
}

// Whether the trait stays, whole or as a mark.
bool keeps(format_capabilities const& room, std::string const& trait) {
  return room.traits || (room.kernel && trait == "kernel_degree") || (room.antialias && trait == "antialias") ||
         (room.origin && trait == "origin");
}

bool another_kernel(splat_traits const& traits) {
  auto const kernel = traits.find("kernel_degree");
  return kernel != traits.end() && kernel->second != "2";
}

}  // namespace

span<splat_format const* const> splat_formats() { return {formats, std::size(formats)}; }

gaussian_model read_splats(std::filesystem::path const& path, splat_traits* traits, std::vector<std::string>* notes) {
  splat_format const* const format = format_of(path);
  if (!format) refuse_path(path);
  return format->read(path, traits, notes);
}

gaussian_model rows_of(gaussian_model const& all, row_owners const& owners) {
  gaussian_model mine;
  mine.sh_degree = all.sh_degree, mine.feature_count = all.feature_count;
  for_each_row_array(
      [&](std::size_t width, auto& to, auto const& from) {
        owners.for_each_run(all.size(), [&](u64 first, u64 count, u64) {
          to.insert(to.end(), from.data() + first * width, from.data() + (first + count) * width);
        });
      },
      all, mine, all);
  return mine;
}

gaussian_model read_splat_rows(std::filesystem::path const& path, row_owners const& owners, u64& total,
                               splat_traits* traits, std::vector<std::string>* notes) {
  if (owners.ranks > 1 && format_of(path) == &ply_format) return read_splat_ply_rows(path, owners, total, traits);
  gaussian_model all = read_splats(path, traits, notes);
  total = all.size();
  return owners.ranks == 1 ? all : rows_of(all, owners);
}

bool is_splat_ply(std::filesystem::path const& path) { return by_name(path) == &ply_format; }

void write_splats(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits,
                  splat_packing const& packing) {
  splat_format const& format = written_as(path);
  if (model.sh_degree < 0 || model.sh_degree > 3 || !model.arrays_agree())
    throw invalid_argument("the arrays of the model to write to " + path.string() + " do not agree in size");
  auto const bits = [](int n) { return n >= 1 && n <= 8; };
  if (!bits(packing.sh1_bits) || !bits(packing.sh_bits) || packing.palette < 0 || packing.palette > 65536)
    throw invalid_argument("splat_packing: bits are 1 to 8, and a palette has 65536 rows at the most");
  if (another_kernel(traits) && !format.capabilities.kernel)
    throw io_error(path.string(),
                   std::string(format.name) + " has no word for the kernel degree " + traits.at("kernel_degree") +
                       " that the model was trained with, and would show Gaussians",
                   "write a .ply or a .compressed.ply, or train with kernel degree 2");
  if (packing.world && !format.capabilities.world)
    throw io_error(path.string(), std::string(format.name) + " has no room for coordinates in double",
                   "write a .ply or a .glb in the capture's coordinates, or keep the origin");
  if (packing.spz && !format.capabilities.spz)
    throw io_error(path.string(), std::string(format.name) + " has no SPZ inside", "write a .glb");
  splat_traits kept;
  for (auto const& trait : traits)
    if (keeps(format.capabilities, trait.first)) kept.insert(trait);
  if (model.sh_degree > format.capabilities.sh_degree)
    format.write(path, with_sh_degree(model, format.capabilities.sh_degree), kept, packing);
  else
    format.write(path, model, kept, packing);
}

std::vector<std::string> left_out(std::filesystem::path const& path, gaussian_model const& model,
                                  splat_traits const& traits, splat_packing const& packing) {
  splat_format const& format = written_as(path);
  std::vector<std::string> lines;
  if (model.sh_degree > format.capabilities.sh_degree)
    lines.push_back("spherical harmonics above degree " + std::to_string(format.capabilities.sh_degree) +
                    " (the model has degree " + std::to_string(model.sh_degree) + ")");
  if (model.feature_count > 0 && !format.capabilities.features)
    lines.push_back(counted(static_cast<std::size_t>(model.feature_count), "feature") + " of each Gaussian");
  if (std::size_t const strays = format.capabilities.strays && !packing.spz ? 0 : io::bulk_of(model).strays.size())
    lines.push_back("the distance of " + counted(strays, "Gaussian") + ", over " +
                    std::to_string(static_cast<int>(io::far_reach)) +
                    " times as far out as 99 of 100: nearer, and as much smaller, they look the same from the middle");
  for (auto const& [key, value] : traits) {
    if (!keeps(format.capabilities, key))
      lines.push_back(key + " " + value);
    else if (key == "antialias" && !format.capabilities.traits && !value.empty())
      lines.push_back("the width of antialias, " + value + ", of which the mark stays");
  }
  return lines;
}

}  // namespace gart
