#pragma once
// `gart info --self-test`: compares the image and gradients of a small scene, by every configuration that runs here,
// with the reference in double (gart/reference/reference.hpp).

namespace gart_cli {

// Prints a line for each configuration; how many disagree.
int self_test();

}  // namespace gart_cli
