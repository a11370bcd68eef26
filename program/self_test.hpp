#pragma once
// What `gart info --self-test` does: a small scene through every configuration that runs here, against its image and
// its gradients by their definition in double (gart/reference/reference.hpp).

namespace gart_cli {

// Prints a line for each configuration; how many disagree.
int self_test();

}  // namespace gart_cli
