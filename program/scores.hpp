#pragma once
// Scores (gart/runtime/evaluate.hpp) as the commands report them.

#include <gart/runtime/evaluate.hpp>

#include <nlohmann/json.hpp>

#include <string>

namespace gart_cli {

// "psnr", "ssim", "psnr_affine_colour" and "views". With exposures "psnr_own_colours", and where views were placed at
// other poses "psnr_capture_poses". A missing number is null.
nlohmann::json to_json(gart::scores const& result);
// "test_views" and the scores of the test views. "training_scores" are those of the training views that were rendered
// for comparison. Their number is "scored_views", of "train_views".
nlohmann::json to_json(gart::scores const& test, gart::scores const& training, std::size_t train_views);
// As a command says them when it is done.
std::string in_words(gart::scores const& test, gart::scores const& training, std::size_t train_views);

}  // namespace gart_cli
