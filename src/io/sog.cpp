// SOG, version 2: a zip file, or a folder, of lossless WebP textures, a pixel a Gaussian. Its meta.json says what their
// bytes mean. Scales and colours are numbers of a codebook, spherical harmonics rows of a palette.
// https://developer.playcanvas.com/user-manual/gaussian-splatting/formats/sog/

#include "bulk.hpp"
#include "codebook.hpp"
#include "packing.hpp"
#include "webp.hpp"
#include "zip.hpp"

#include <gart/io/file.hpp>
#include <gart/io/json_fault.hpp>
#include <gart/io/splat_file.hpp>

#include <nlohmann/json.hpp>

#include <optional>

namespace gart {
namespace {

using namespace io;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr double root = 1.41421356237309504880;
constexpr std::size_t palette_columns = 64, most_rows = 65536, gaussians_a_row = 4;
// Steps of logarithms of scales and of the coefficients of degree 0. Bands above have a step that adds this much to the
// squared error of their palette.
constexpr double scale_step = 1.0 / 16, base_step = 0.03, error_added = 0.2;
constexpr u8 first_tag = 252;  // of the largest component w; then x, y, z

double squeezed(double x) { return x < 0 ? -std::log1p(-x) : std::log1p(x); }
double unsqueezed(double x) { return x < 0 ? -std::expm1(-x) : std::expm1(x); }

// Three of a unit quaternion w, x, y, z, a byte each, and which is the fourth.
void pack_rotation(float const* wxyz, u8* rgba) {
  std::array<double, 4> q = unit(wxyz);
  int const largest = largest_positive(q);
  for (int k = 0, at = 0; k < 4; ++k)
    if (k != largest) rgba[at++] = static_cast<u8>(unorm(q[static_cast<std::size_t>(k)] * root / 2 + 0.5, 8));
  rgba[3] = static_cast<u8>(first_tag + largest);
}

bool unpack_rotation(u8 const* rgba, float* wxyz) {
  if (rgba[3] < first_tag) return false;
  std::size_t const largest = rgba[3] - first_tag;
  double rest = 1;
  for (std::size_t k = 0, at = 0; k < 4; ++k) {
    if (k == largest) continue;
    double const v = (rgba[at++] / 255.0 * 2 - 1) / root;
    wxyz[k] = static_cast<float>(v), rest -= v * v;
  }
  wxyz[largest] = static_cast<float>(std::sqrt(std::max(0.0, rest)));
  return true;
}

// The entries of a SOG: a zip file, a folder, or the folder of a meta.json.
class sog_entries {
 public:
  explicit sog_entries(fs::path const& path) : name_(path.string()) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) {
      folder_ = path;
    } else if (path.filename() == "meta.json") {
      folder_ = path.has_parent_path() ? path.parent_path() : fs::path(".");
    } else {
      bytes_ = read_file(path), size_ = bytes_.size();
      zip_.emplace(bytes_, name_);
      return;
    }
    for (fs::directory_iterator at(folder_, ignored), end; !ignored && at != end; at.increment(ignored))
      if (std::error_code code; at->is_regular_file(code)) size_ += at->file_size(code);
  }
  u64 size() const { return size_; }

  std::vector<u8> get(std::string const& entry, std::size_t most) const {
    if (zip_) return zip_->get(entry, most);
    if (fs::path(entry).filename().string() != entry)
      throw io_error(name_ + ": meta.json", "names the file " + entry + ", which is not beside it", "export it again");
    std::error_code code;
    if (fs::file_size(folder_ / entry, code) > most && !code)
      throw io_error((folder_ / entry).string(), "is larger than belongs there", "export it again");
    return read_file(folder_ / entry);
  }

  // The folder within the zip file, where it is no SOG.
  void require_meta() const {
    if (!zip_) return;
    std::string models;
    for (std::string const& entry : zip_->names()) {
      if (entry == "meta.json" || entry.ends_with("/meta.json")) return;
      for (auto const* format : splat_formats())
        if (models.empty() && entry.ends_with(format->extension)) models = entry;
    }
    if (!models.empty()) throw io_error(name_, "is a zip file around " + models, "unpack it, and name " + models);
    throw io_error(name_, "is a zip file without the meta.json of SOG", "name a file of Gaussians");
  }

 private:
  std::string name_;
  fs::path folder_;
  std::vector<u8> bytes_;
  u64 size_ = 0;
  std::optional<zip_reader> zip_;
};

class sog_reader {
 public:
  explicit sog_reader(fs::path const& path) : name_(path.string()), entries_(path) {}

  gaussian_model read(splat_traits* traits, std::vector<std::string>* notes) {
    entries_.require_meta();
    try {
      return from(json::parse(entries_.get("meta.json", entries_.size() + (1 << 16))), traits, notes);
    } catch (json::exception const& e) {
      throw io_error(name_ + ": meta.json", json_fault_of(e.what()).what, "export it again");
    }
  }

 private:
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy = "export it again") const {
    throw io_error(name_ + ": meta.json", what, remedy);
  }

  texture image(json const& of, std::size_t number, std::size_t least, std::size_t most) const {
    auto const entry = of.at("files").at(number).get<std::string>();
    texture t = decode_webp(entries_.get(entry, entries_.size() * 4 + (1 << 20)), most, name_, entry);
    if (t.pixels() < least)
      throw io_error(name_, "the entry " + entry + " has fewer pixels than there are Gaussians", "export it again");
    return t;
  }

  std::array<float, 256> numbers(json const& of) const {
    auto const list = of.at("codebook").get<std::vector<double>>();
    if (list.size() > 256) refuse("a codebook has more than 256 numbers");
    std::array<float, 256> all{};
    std::transform(list.begin(), list.end(), all.begin(), [](double v) { return static_cast<float>(v); });
    return all;
  }

  gaussian_model from(json const& meta, splat_traits* traits, std::vector<std::string>* notes) {
    if (!meta.is_object() || meta.value("version", 1) != 2)
      refuse("is not of version 2", "gart reads SOG of version 2: write it again by a newer splat-transform");
    u64 const n = meta.at("count").get<u64>();
    bool const colored = meta.contains("shN") && !meta["shN"].is_null();
    int const degree = colored ? meta["shN"].at("bands").get<int>() : 0;
    if (degree < 0 || degree > 3) refuse("shN.bands is " + std::to_string(degree) + ", not 0 to 3");
    require_plausible(name_, n, degree, entries_.size());
    // A texture has a pixel a Gaussian, and what fills its last rows.
    std::size_t const most = n + n / 4 + (std::size_t{1} << 16);
    gaussian_model m;
    m.resize(n, degree);
    means(meta.at("means"), m, most);
    {
      texture const t = image(meta.at("quats"), 0, n, most);
      for (std::size_t i = 0; i < n; ++i)
        if (!unpack_rotation(&t.rgba[4 * i], &m.quaternion[4 * i])) m.quaternion[4 * i] = 1;
    }
    std::size_t const width = 3 * static_cast<std::size_t>(sh_coefficients(degree));
    {
      texture const t = image(meta.at("scales"), 0, n, most);
      auto const value = numbers(meta["scales"]);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t c = 0; c < 3; ++c) m.log_scale[3 * i + c] = value[t.rgba[4 * i + c]];
    }
    {
      texture const t = image(meta.at("sh0"), 0, n, most);
      auto const value = numbers(meta["sh0"]);
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t c = 0; c < 3; ++c) m.sh[width * i + c] = value[t.rgba[4 * i + c]];
        m.opacity[i] = opacity_logit(t.rgba[4 * i + 3]);
      }
    }
    if (degree > 0) harmonics(meta["shN"], m, most);
    keep_usable(name_, m, notes);
    if (traits) {
      if (meta.contains("gart"))
        for (auto const& [key, value] : meta["gart"].items()) (*traits)[key] = value.get<std::string>();
      if (meta.value("antialias", false)) traits->try_emplace("antialias", "");
    }
    return m;
  }

  void means(json const& of, gaussian_model& m, std::size_t most) const {
    texture const low = image(of, 0, m.size(), most), high = image(of, 1, m.size(), most);
    for (std::size_t c = 0; c < 3; ++c) {
      double const least = of.at("mins").at(c).get<double>(), greatest = of.at("maxs").at(c).get<double>();
      for (std::size_t i = 0; i < m.size(); ++i) {
        u32 const v = u32{low.rgba[4 * i + c]} | u32{high.rgba[4 * i + c]} << 8;
        m.mean[3 * i + c] = static_cast<float>(unsqueezed(least + (greatest - least) * v / 65535.0));
      }
    }
  }

  void harmonics(json const& of, gaussian_model& m, std::size_t most) const {
    std::size_t const k = static_cast<std::size_t>(sh_coefficients(m.sh_degree)), rest = k - 1;
    texture const rows = image(of, 0, 0, palette_columns * rest * (most_rows / palette_columns)),
                  labels = image(of, 1, m.size(), most);
    if (static_cast<std::size_t>(rows.width) != palette_columns * rest)
      refuse("shN has a palette of " + std::to_string(rows.width) + " pixels a row, not 64 Gaussians' coefficients");
    std::size_t const count = static_cast<std::size_t>(rows.height) * palette_columns;
    auto const value = numbers(of);
    for (std::size_t i = 0; i < m.size(); ++i) {
      std::size_t const label = labels.rgba[4 * i] | std::size_t{labels.rgba[4 * i + 1]} << 8;
      if (label >= count) refuse("Gaussian " + std::to_string(i) + " has a row past the palette's end");
      for (std::size_t j = 0; j < 3 * rest; ++j)
        m.sh[3 * (k * i + 1) + j] = value[rows.rgba[4 * (label * rest + j / 3) + j % 3]];
    }
  }

  std::string name_;
  sog_entries entries_;
};

class sog_writer {
 public:
  sog_writer(fs::path const& path, gaussian_model const& m) : path_(path), m_(m) {
    // As near to a square as rows of four allow.
    std::size_t const root_of = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(m.size()))));
    width_ = std::max<std::size_t>(4, (root_of + 3) / 4 * 4);
    height_ = std::max<std::size_t>(4, ((m.size() + width_ - 1) / width_ + 3) / 4 * 4);
    if (width_ > 16383)
      throw io_error(path.string(), "SOG has no room for " + std::to_string(m.size()) + " Gaussians, past 268 million",
                     "keep fewer of them");
  }

  void write(splat_traits const& traits, splat_packing const& packing) {
    std::size_t const n = m_.size(), k = static_cast<std::size_t>(sh_coefficients(m_.sh_degree));
    json meta = {{"version", 2}, {"asset", {{"generator", "gart"}}}, {"count", n}};
    if (traits.count("antialias")) meta["antialias"] = true;
    if (!traits.empty()) meta["gart"] = traits;
    meta["means"] = means();
    texture quats = blank(), scales = blank(), colors = blank();
    std::vector<float> base;
    for (std::size_t i = 0; i < n; ++i) base.insert(base.end(), &m_.sh[3 * k * i], &m_.sh[3 * k * i] + 3);
    auto const scale = codebook::even(m_.log_scale, scale_step), color = codebook::even(base, base_step);
    for (std::size_t i = 0; i < n; ++i) {
      pack_rotation(&m_.quaternion[4 * i], &quats.rgba[4 * i]);
      for (std::size_t c = 0; c < 3; ++c) {
        scales.rgba[4 * i + c] = scale.nearest(m_.log_scale[3 * i + c]);
        colors.rgba[4 * i + c] = color.nearest(base[3 * i + c]);
      }
      scales.rgba[4 * i + 3] = 255;
      colors.rgba[4 * i + 3] = opacity_byte(m_.opacity[i]);
    }
    meta["scales"] = {{"codebook", scale.numbers()}, {"files", {put("scales.webp", scales)}}};
    meta["quats"] = {{"files", {put("quats.webp", quats)}}};
    meta["sh0"] = {{"codebook", color.numbers()}, {"files", {put("sh0.webp", colors)}}};
    if (m_.sh_degree > 0) meta["shN"] = harmonics(packing);
    std::string const text = meta.dump();
    entries_.insert(entries_.begin(), {"meta.json", {text.begin(), text.end()}});
    write_file(path_, zip_of(entries_, path_.string()));
  }

 private:
  texture blank() const { return texture(static_cast<int>(width_), static_cast<int>(height_)); }

  std::string put(std::string const& entry, texture const& t) {
    entries_.emplace_back(entry, encode_webp(t, path_.string()));
    return entry;
  }

  json means() {
    texture low = blank(), high = blank();
    json mins = json::array(), maxs = json::array();
    for (std::size_t c = 0; c < 3; ++c) {
      double least = 0, greatest = 0;
      for (std::size_t i = 0; i < m_.size(); ++i) {
        double const v = squeezed(static_cast<double>(m_.mean[3 * i + c]));
        least = i ? std::min(least, v) : v, greatest = i ? std::max(greatest, v) : v;
      }
      mins.push_back(least), maxs.push_back(greatest);
      for (std::size_t i = 0; i < m_.size(); ++i) {
        double const v = squeezed(static_cast<double>(m_.mean[3 * i + c]));
        u32 const packed = greatest > least ? unorm((v - least) / (greatest - least), 16) : 0;
        low.rgba[4 * i + c] = static_cast<u8>(packed), high.rgba[4 * i + c] = static_cast<u8>(packed >> 8);
        low.rgba[4 * i + 3] = high.rgba[4 * i + 3] = 255;
      }
    }
    return {{"mins", mins}, {"maxs", maxs}, {"files", {put("means_l.webp", low), put("means_u.webp", high)}}};
  }

  // Gaussians that are hardly ever seen still count a hundredth of those that hide all behind them.
  std::vector<float> weights() const {
    std::vector<float> all(m_.size());
    for (std::size_t i = 0; i < m_.size(); ++i) all[i] = std::max(0.01f, opacity_byte(m_.opacity[i]) / 255.0f);
    return all;
  }

  json harmonics(splat_packing const& packing) {
    std::size_t const n = m_.size(), k = static_cast<std::size_t>(sh_coefficients(m_.sh_degree)), rest = k - 1;
    std::vector<float> rows;
    rows.reserve(3 * rest * n);
    for (std::size_t i = 0; i < n; ++i) rows.insert(rows.end(), &m_.sh[3 * k * i] + 3, &m_.sh[3 * k * i] + 3 * k);
    std::size_t const usual = std::max(palette_columns, n / gaussians_a_row / palette_columns * palette_columns);
    std::size_t const count = std::min(packing.palette ? static_cast<std::size_t>(packing.palette) : usual, most_rows);
    palette const p = shared_rows(rows, weights(), 3 * rest, count);
    auto const value = codebook::even(p.rows, std::sqrt(12 * error_added * p.error));
    std::size_t const lines = std::max<std::size_t>(1, (p.count() + palette_columns - 1) / palette_columns);
    texture table(static_cast<int>(palette_columns * rest), static_cast<int>(lines)), labels = blank();
    for (std::size_t i = 0; i < p.rows.size(); ++i) table.rgba[4 * (i / 3) + i % 3] = value.nearest(p.rows[i]);
    for (std::size_t i = 3; i < table.rgba.size(); i += 4) table.rgba[i] = 255;
    for (std::size_t i = 0; i < n; ++i) {
      labels.rgba[4 * i] = static_cast<u8>(p.of[i]), labels.rgba[4 * i + 1] = static_cast<u8>(p.of[i] >> 8);
      labels.rgba[4 * i + 3] = 255;
    }
    return {{"count", p.count()},
            {"bands", m_.sh_degree},
            {"codebook", value.numbers()},
            {"files", {put("shN_centroids.webp", table), put("shN_labels.webp", labels)}}};
  }

  fs::path path_;
  gaussian_model const& m_;
  std::size_t width_, height_;
  std::vector<std::pair<std::string, std::vector<u8>>> entries_;
};

}  // namespace

extern splat_format const sog_format;
splat_format const sog_format = {
    "SOG",
    ".sog",
    {.strays = false, .traits = true},
    [](std::string_view first) { return first.starts_with("PK\x03\x04"); },
    [](fs::path const& path, splat_traits* traits, std::vector<std::string>* notes) {
      return sog_reader(path).read(traits, notes);
    },
    [](fs::path const& path, gaussian_model const& model, splat_traits const& traits, splat_packing const& packing) {
      require_packable(path, model);
      gaussian_model sorted = selected(model, along_a_curve(model));
      draw_in_strays(sorted, far_reach);
      sog_writer(path, sorted).write(traits, packing);
    }};

}  // namespace gart
