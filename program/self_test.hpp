#pragma once
// `gart info --self-test` renders a small scene by every configuration that runs here. It compares image and gradients
// with the reference in double (gart/reference/reference.hpp).

namespace gart_cli {

// Prints a line for each configuration; how many disagree.
int self_test();

}  // namespace gart_cli
