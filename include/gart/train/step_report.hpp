#pragma once
/// \file
/// The report of a training step.

#include <gart/core/types.hpp>

#include <string>

namespace gart {

/// The report of a step.
struct step_report {
  int step = 0;           ///< steps done, this one included
  float loss = 0;         ///< of this step's training view
  float psnr = 0;         ///< of this step's training view
  index_t gaussians = 0;  ///< after the step
  std::string view;       ///< its name
  std::string backward;   ///< the method of this step: not the one asked for where its hit buffer would pass the budget
  u64 skipped = 0;        ///< with check_finite: numbers that Adam left as they were, their updates not being finite
};

}  // namespace gart
