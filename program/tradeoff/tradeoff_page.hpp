#pragma once
// What `gart tradeoff` shows of tradeoff.json: a table in text, and a page with the fronts.

#include <nlohmann/json.hpp>

#include <string>

namespace gart_cli {

// The parameters whose gradients are compared.
inline constexpr char const* tradeoff_groups[] = {"mean", "log_scale", "quaternion", "opacity", "sh"};

// Sets front.image and front.gradients of each setting. They are true if no other is at least as fast, by "clock", and
// as close, and better in one.
void mark_fronts(nlohmann::json& result);

std::string tradeoff_table(nlohmann::json const& result);
std::string tradeoff_page(nlohmann::json const& result);

}  // namespace gart_cli
