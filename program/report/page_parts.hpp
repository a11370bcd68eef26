#pragma once
// Shared by the pages that gart writes: optional JSON values as HTML, and images inside the page.

#include <gart/scene/image.hpp>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gart_cli {

// Not a number if absent.
double number_of(nlohmann::json const& all, char const* key);
// Escaped; "" if absent.
std::string text_of(nlohmann::json const& all, char const* key);
// With commas; "-" if absent.
std::string count_of(nlohmann::json const& all, char const* key);

// Scaled down by a whole factor where it is wider than that.
std::vector<gart::u8> page_jpeg(gart::image8 const& image, int widest = 480);
// An <img> with the file in it; `first` where a reader sees it at once.
std::string page_image(std::vector<gart::u8> const& jpeg, std::string const& alt, bool first = false);

// All before the first heading: the title, escaped, and the style sheet.
std::string page_start(std::string const& title);
std::string page_end();

// An option's value: a text, a number, or NAME=VALUE,... of an object.
std::string in_words(nlohmann::json const& value);

}  // namespace gart_cli
