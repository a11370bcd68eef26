#include <gart/io/camera_file.hpp>
#include <gart/io/file.hpp>

#include <nlohmann/json.hpp>

namespace gart {

void write_cameras(std::filesystem::path const& path, std::vector<named_camera> const& cameras) {
  using nlohmann::json;
  json list = json::array();
  for (auto const& [name, view] : cameras) {
    json c = {{"name", name},  {"width", view.width}, {"height", view.height}, {"fx", view.fx},
              {"fy", view.fy}, {"cx", view.cx},       {"cy", view.cy}};
    if (view.lens.any()) {
      c["camera_model"] = "OPENCV";
      c["k1"] = view.lens.k1, c["k2"] = view.lens.k2, c["p1"] = view.lens.p1, c["p2"] = view.lens.p2;
    }
    json rows = json::array();
    for (int row = 0; row < 3; ++row) {
      json values = json::array();
      for (int column = 0; column < 3; ++column) values.push_back(view.rotation[column][row]);
      values.push_back(view.position[row]);
      rows.push_back(std::move(values));
    }
    rows.push_back({0, 0, 0, 1});
    c["c2w"] = std::move(rows);
    list.push_back(std::move(c));
  }
  write_file(path, list.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace gart
