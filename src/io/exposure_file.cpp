#include "json_record.hpp"

#include <gart/core/error.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/file.hpp>

#include <nlohmann/json.hpp>

#include <cmath>

namespace gart {

namespace {

using nlohmann::json;

constexpr char remedy[] = "take the exposures.json that gart train wrote beside the model";

// `count` finite numbers of the field of a view or lens.
template <class T>
void read_numbers(json const& view, char const* key, std::size_t count, T* to, std::string const& where) {
  auto const refuse = [&] {
    throw io_error(where, std::string("'") + key + "' is not a list of " + std::to_string(count) + " finite numbers",
                   remedy);
  };
  auto const found = view.find(key);
  if (found == view.end() || !found->is_array() || found->size() != count) refuse();
  for (std::size_t k = 0; k < count; ++k) {
    if (!(*found)[k].is_number()) refuse();
    to[k] = (*found)[k].get<T>();
    if (!std::isfinite(static_cast<float>(to[k]))) refuse();
  }
}

}  // namespace

void write_exposures(std::filesystem::path const& path, exposure_field const& field, vec3d const& origin) {
  json views = json::array();
  for (view_exposure const& v : field.views()) {
    vec3d const position = v.position + origin;
    views.push_back({{"name", v.name},
                     {"position", {position.x, position.y, position.z}},
                     {"direction", {v.direction.x, v.direction.y, v.direction.z}},
                     {"matrix", v.value.m}});
  }
  json lenses = json::array();
  for (lens_falloff const& l : field.lenses())
    lenses.push_back({{"focal", {l.focal.x, l.focal.y}}, {"center", {l.center.x, l.center.y}}, {"falloff", l.value.k}});
  write_file(path, json{{"views", std::move(views)}, {"lenses", std::move(lenses)}}.dump(
                       1, ' ', false, json::error_handler_t::replace) +
                       "\n");
}

exposure_field read_exposures(std::filesystem::path const& path, vec3d const& origin) {
  std::vector<u8> const bytes = io::with_words_quoted(read_file(path));
  json const file = json::parse(bytes.begin(), bytes.end(), nullptr, false);
  auto const list = [&](char const* key) {
    json const all = file.is_object() ? file.value(key, json()) : json();
    if (!all.is_null() && !all.is_array())
      throw io_error(path.string(), std::string("'") + key + "' is no list", remedy);
    return all;
  };
  json const views = list("views"), falloffs = list("lenses");
  if (views.empty() && falloffs.empty())
    throw io_error(path.string(), "is no JSON object with a list 'views' or a list 'lenses'", remedy);
  auto const place = [&](char const* of, std::size_t number, json const& entry) {
    std::string const where = path.string() + ": " + of + " " + std::to_string(number);
    if (!entry.is_object()) throw io_error(where, "is not an object", remedy);
    return where;
  };
  std::vector<view_exposure> all;
  for (json const& view : views) {
    std::string const where = place("view", all.size(), view);
    view_exposure v;
    if (auto const name = view.find("name"); name != view.end() && name->is_string()) v.name = name->get<std::string>();
    read_numbers(view, "position", 3, &v.position.x, where);
    v.position -= origin;
    read_numbers(view, "direction", 3, &v.direction.x, where);
    read_numbers(view, "matrix", exposure::floats, v.value.m, where);
    all.push_back(std::move(v));
  }
  std::vector<lens_falloff> lenses;
  for (json const& lens : falloffs) {
    std::string const where = place("lens", lenses.size(), lens);
    lens_falloff l;
    read_numbers(lens, "focal", 2, &l.focal.x, where);
    read_numbers(lens, "center", 2, &l.center.x, where);
    read_numbers(lens, "falloff", vignetting::floats, l.value.k, where);
    lenses.push_back(l);
  }
  return exposure_field(std::move(all), std::move(lenses));
}

}  // namespace gart
