#include "commands.hpp"
#include "help.hpp"
#include "output.hpp"
#include "printable.hpp"
#include "progress.hpp"

#include <gart/core/error.hpp>
#include <gart/core/words.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/math/logit.hpp>
#include <gart/scene/select.hpp>
#include <gart/scene/similarity.hpp>
#include <gart/view/scene.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct convert_arguments {
  fs::path in, out;
  std::string crop, transform, sh_bits, origin;
  double prune = 0;
  int sh_degree = 3;
  gart::splat_packing packing;
  bool quiet = false;
};

std::vector<double> numbers(std::string const& option, std::string_view text) {
  std::vector<double> all;
  while (true) {
    std::string_view const word = text.substr(0, text.find(','));
    double value = 0;
    auto const [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (code != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      throw usage_error(option + ": '" + std::string(word) + "' is not a number (numbers with commas, no spaces)");
    all.push_back(value);
    if (word.size() == text.size()) return all;
    text.remove_prefix(word.size() + 1);
  }
}

gart::similarity similarity_named(std::string const& text) {
  auto const v = numbers("--transform", text);
  try {
    if (v.size() == 16) {
      std::array<double, 16> m;
      std::copy(v.begin(), v.end(), m.begin());
      return gart::similarity_of(m);
    }
    if (v.size() == 7 || v.size() == 8) {
      double const scale = v.size() == 8 ? v[7] : 1;
      if (!(scale > 0)) throw gart::invalid_argument("the scale must be above 0");
      if (v[0] == 0 && v[1] == 0 && v[2] == 0 && v[3] == 0)
        throw gart::invalid_argument("the quaternion is all zero, which is no rotation");
      return {gart::rotation_of({v[0], v[1], v[2], v[3]}), scale, gart::vec3d(v[4], v[5], v[6])};
    }
  } catch (gart::invalid_argument const& e) {
    throw usage_error(std::string("--transform: ") + e.what());
  }
  throw usage_error("--transform: " + std::to_string(v.size()) +
                    " numbers, not 16 (a matrix), 7 (quaternion, translation) or 8 (and a scale)");
}

gart::gaussian_model pruned(gart::gaussian_model const& model, double least_opacity) {
  std::vector<gart::u32> kept;
  for (std::size_t i = 0; i < model.size(); ++i)
    if (gart::sigmoid_in_double(static_cast<double>(model.opacity[i])) >= least_opacity)
      kept.push_back(static_cast<gart::u32>(i));
  return gart::selected(model, kept);
}

// By the ending of the name.
gart::splat_format const& format_to_write(fs::path const& out) {
  std::string const name = gart::lower(out.filename().string());
  std::string written;
  for (gart::splat_format const* format : gart::splat_formats()) {
    if (!format->write) continue;
    if (name.ends_with(format->extension)) return *format;
    written += (written.empty() ? "" : ", ") + std::string(format->extension);
  }
  throw usage_error(out.string() + ": has the ending of no format of Gaussians that gart writes (name it " + written +
                    ")");
}

// Options that are of other formats alone.
void check_packing(convert_arguments const& a, gart::splat_format const& format) {
  auto const require = [&](char const* option, bool given, bool fits, char const* remedy) {
    if (given && !fits)
      throw usage_error(std::string(option) + ": " + format.name + " has nothing of the kind (write " + remedy +
                        ", or leave " + option + " out)");
  };
  std::string_view const ending = format.extension;
  require("--world", a.packing.world, format.capabilities.world, "a .ply or a .glb");
  require("--spz", a.packing.spz, format.capabilities.spz, "a .glb");
  require("--sh-bits", !a.sh_bits.empty(), ending == ".spz" || a.packing.spz, "a .spz, or a .glb with --spz");
  require("--palette", a.packing.palette > 0, ending == ".sog", "a .sog");
}

// Empty where there is none.
std::vector<double> box_of(std::string const& crop) {
  if (crop.empty()) return {};
  std::vector<double> const box = numbers("--crop", crop);
  if (box.size() != 6)
    throw usage_error("--crop: " + std::to_string(box.size()) + " numbers, not the 6 of two corners");
  for (std::size_t k = 0; k < 3; ++k)
    if (box[k] > box[k + 3])
      throw usage_error("--crop " + crop + ": its corners are swapped, " + "xyz"[k] + " goes from " +
                        gart::short_number(box[k]) + " to " + gart::short_number(box[k + 3]) +
                        " (give the least corner first)");
  return box;
}

int run_convert(convert_arguments const& a) {
  std::optional<gart::similarity> moved;
  if (!a.transform.empty()) moved = similarity_named(a.transform);
  std::vector<double> const box = box_of(a.crop);
  gart::splat_format const& format = format_to_write(a.out);
  check_packing(a, format);
  gart::splat_packing packing = a.packing;
  if (!a.sh_bits.empty()) {
    auto const bits = numbers("--sh-bits", a.sh_bits);
    if (bits.size() != 2 || bits[0] < 1 || bits[0] > 8 || bits[1] < 1 || bits[1] > 8)
      throw usage_error("--sh-bits: two numbers from 1 to 8 belong there, as in 5,5");
    packing.sh1_bits = static_cast<int>(bits[0]), packing.sh_bits = static_cast<int>(bits[1]);
  }
  std::vector<double> const origin = a.origin.empty() ? std::vector<double>() : numbers("--origin", a.origin);
  if (!origin.empty() && origin.size() != 3)
    throw usage_error("--origin: " + std::to_string(origin.size()) + " numbers, not the 3 of a place");
  prepare_file(a.out);

  gart::splat_traits traits;
  std::vector<std::string> notes;
  gart::gaussian_model model = gart::read_splats(a.in, &traits, &notes);
  if (!origin.empty()) {
    if (gart::vec3d const own = gart::origin_of(traits, a.in.string()); own != gart::vec3d(0.0))
      throw usage_error("--origin " + a.origin + ": " + a.in.string() + " says that it is from the origin " +
                        gart::to_text(own) + " (leave --origin out)");
    traits = gart::with_origin(traits, {origin[0], origin[1], origin[2]});
  }
  std::size_t const read = model.size();
  if (!box.empty()) {
    // In floats, as coordinates are: a corner that was printed with nine digits is the float that it was.
    auto const corner = [&](std::size_t at) { return gart::vec3(gart::vec3d(box[at], box[at + 1], box[at + 2])); };
    model = gart::cropped(model, {corner(0), corner(3)});
  }
  if (a.prune > 0) model = pruned(model, a.prune);
  if (model.size() == 0)
    throw gart::io_error(a.in.string(), "no Gaussian is left", "a larger --crop, or a smaller --prune, keeps some");
  model = gart::with_sh_degree(std::move(model), std::min(a.sh_degree, model.sh_degree));
  if (moved) gart::apply(*moved, model);

  std::vector<std::string> lost = gart::left_out(a.out, model, traits, packing);
  if (fs::exists(a.in.parent_path() / "exposures.json"))
    lost.push_back("exposures and falloffs of lenses in " + (a.in.parent_path() / "exposures.json").string() +
                   ", which no format holds");
  gart::write_splats(a.out, model, traits, packing);
  if (a.quiet) return 0;
  if (gart::vec3d const from = gart::origin_of(traits, a.in.string()); from != gart::vec3d(0.0) && !packing.world)
    notes.push_back("coordinates are from the origin " + gart::to_text(from));
  for (std::string const& note : notes) std::printf("%s\n", printable(note).c_str());
  for (std::string const& what : lost) std::printf("left out: %s\n", what.c_str());
  auto const after = static_cast<double>(fs::file_size(a.out));
  std::printf("%s: %zu of %zu Gaussians, SH degree %d, %s", a.out.string().c_str(), model.size(), read,
              std::min(model.sh_degree, format.capabilities.sh_degree), as_bytes(after).c_str());
  if (fs::is_regular_file(a.in))
    std::printf(", %.3f of %s", after / static_cast<double>(fs::file_size(a.in)), a.in.filename().string().c_str());
  std::puts("");
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, command& selected) {
  auto a = std::make_shared<convert_arguments>();
  CLI::App* convert = app.add_subcommand("convert", "Write a model in another format, cropped, pruned or moved.");
  add_open(*convert, "IN", a->in, "", "Gaussians in any format; its first bytes say which")->required();
  add_open(*convert, "OUT", a->out, "",
           "Where they go; the ending says the format: .ply, .compressed.ply,\n.spz, .sog, .splat or .glb")
      ->required();
  add_open(*convert, "--sh-degree", a->sh_degree, "D", "Keep spherical harmonics to this degree, 0 to 3")
      ->check(between(0, 3));
  add_open(*convert, "--crop", a->crop, "x,y,z,X,Y,Z",
           "Keep the Gaussians whose means lie in this box: its least and its\ngreatest corner");
  add_open(*convert, "--prune", a->prune, "A", "Leave out Gaussians of less opacity than this, 0 to 1")
      ->check(between(0, 1));
  add_open(*convert, "--transform", a->transform, "NUMBERS",
           "Turn, scale and move: a 4x4 matrix row by row, or a quaternion,\na translation "
           "and perhaps a scale: w,x,y,z,X,Y,Z,S");
  add_open(*convert, "--origin", a->origin, "X,Y,Z",
           "What IN's coordinates are from, in those of the capture, where IN\ndoes not say it");
  convert->add_flag("--world", a->packing.world,
                    "PLY and GLB: in the coordinates of the capture, in double, and not\nfrom an origin");
  convert->add_flag("--spz", a->packing.spz,
                    "GLB: packed as SPZ 2, a tenth of the size; not all programs that\nread GLB know it");
  add_open(*convert, "--sh-bits", a->sh_bits, "A,B",
           "SPZ: bits of a coefficient of degree 1, and of those above, 1 to 8\n(default: 6,6)");
  add_open(*convert, "--palette", a->packing.palette, "N",
           "SOG: rows of coefficients that all Gaussians share, to 65536\n(default: one for four of them)")
      ->check(between(1, 65536));
  add_quiet(*convert, a->quiet);
  convert->footer(
      "\nWrites OUT whole or not at all. The box and the opacity are IN's own; the rest is moved after.\n"
      "Properties that OUT's format cannot hold are reported, or refused where the image would change without them.\n"
      "\nExamples:\n"
      "  gart convert run/model.ply scene.spz\n"
      "  gart convert scene.sog part.glb --crop -1,-1,-1,1,1,1 --prune 0.02\n"
      "  gart convert model.ply turned.ply --transform 0.7071,0.7071,0,0,0,0,0,2");
  convert->callback([a, &selected] { selected = [a] { return run_convert(*a); }; });
}

}  // namespace gart_cli
