#pragma once
// Processor time: the cost of a step where other programs share the machine, and wall time says little.

#include <ctime>

namespace gart_cli {

// Milliseconds of all of the program's threads, from a start of its own.
inline double processor_ms() { return 1000.0 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace gart_cli
