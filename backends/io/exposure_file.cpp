#include <gart/core/error.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/file.hpp>

#include <nlohmann/json.hpp>

#include <cmath>

namespace gart {

namespace {

using nlohmann::json;

constexpr char remedy[] = "take the exposures.json that gart train wrote beside the model";

// `count` finite numbers of a view's field.
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

void write_exposures(std::filesystem::path const& path, exposure_field const& field) {
  json views = json::array();
  for (view_exposure const& v : field.views()) {
    views.push_back({{"name", v.name},
                     {"position", {v.position.x, v.position.y, v.position.z}},
                     {"direction", {v.direction.x, v.direction.y, v.direction.z}},
                     {"matrix", v.value.m}});
  }
  write_file(path, json{{"views", std::move(views)}}.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

exposure_field read_exposures(std::filesystem::path const& path) {
  std::vector<u8> const bytes = read_file(path);
  json const file = json::parse(bytes.begin(), bytes.end(), nullptr, false);
  auto const views = file.is_object() ? file.find("views") : file.end();
  if (!file.is_object() || views == file.end() || !views->is_array() || views->empty())
    throw io_error(path.string(), "is no JSON object with a list 'views'", remedy);
  std::vector<view_exposure> all;
  for (json const& view : *views) {
    std::string const where = path.string() + ": view " + std::to_string(all.size());
    if (!view.is_object()) throw io_error(where, "is not an object", remedy);
    view_exposure v;
    if (auto const name = view.find("name"); name != view.end() && name->is_string()) v.name = name->get<std::string>();
    read_numbers(view, "position", 3, &v.position.x, where);
    read_numbers(view, "direction", 3, &v.direction.x, where);
    read_numbers(view, "matrix", exposure::floats, v.value.m, where);
    all.push_back(std::move(v));
  }
  return exposure_field(std::move(all));
}

}  // namespace gart
