#pragma once
// report.html: how a training run went, in one page that needs no other file and no network. Figures come from what
// metrics.json and config.json say, so that page and files cannot disagree.

#include "history.hpp"
#include "report_views.hpp"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gart_cli {

std::string report_page(nlohmann::json const& metrics, nlohmann::json const& config, history const& course,
                        report_cover const& cover, std::vector<report_view> const& views);

}  // namespace gart_cli
