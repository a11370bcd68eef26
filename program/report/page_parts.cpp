#include "page_parts.hpp"

#include "progress.hpp"
#include "report_style.hpp"
#include "svg_chart.hpp"

#include <gart/core/version.hpp>
#include <gart/io/image_file.hpp>

#include <algorithm>
#include <cmath>

namespace gart_cli {

namespace {

using nlohmann::json;

std::string base64(std::vector<gart::u8> const& bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::size_t const n = std::min<std::size_t>(3, bytes.size() - i);
    unsigned word = bytes[i] << 16;
    if (n > 1) word |= bytes[i + 1] << 8;
    if (n > 2) word |= bytes[i + 2];
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? digits[word >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

}  // namespace

double number_of(json const& all, char const* key) {
  return all.contains(key) && all[key].is_number() ? all[key].get<double>() : std::nan("");
}

std::string text_of(json const& all, char const* key) {
  return all.contains(key) && all[key].is_string() ? html_escape(all[key].get<std::string>()) : "";
}

std::string count_of(json const& all, char const* key) {
  double const v = number_of(all, key);
  return std::isfinite(v) ? with_commas(static_cast<std::uint64_t>(v)) : "-";
}

std::vector<gart::u8> page_jpeg(gart::image8 const& image, int widest) {
  int const factor = std::max(1, (image.width + widest - 1) / widest);
  return gart::encode_jpeg(factor > 1 ? gart::box_downscale(image, factor) : image, 88);
}

std::string page_image(std::vector<gart::u8> const& jpeg, std::string const& alt, bool first) {
  return std::string("<img ") + (first ? "" : "loading=\"lazy\" ") + "alt=\"" + alt +
         "\" src=\"data:image/jpeg;base64," + base64(jpeg) + "\">";
}

std::string page_start(std::string const& title) {
  return "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + title +
         " - gart</title><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><style>" +
         report_style + "</style></head><body><main>";
}

std::string page_end() { return "<footer>gart " + std::string(gart::version) + "</footer></main></body></html>\n"; }

std::string in_words(nlohmann::json const& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_object()) {
    std::string all;
    for (auto const& [name, one] : value.items()) all += (all.empty() ? "" : ",") + name + "=" + in_words(one);
    return all;
  }
  if (!value.is_number_float()) return value.dump();
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value.get<double>());
  return text;
}

}  // namespace gart_cli
