#pragma once
// How many threads a command's parallel loops have, and how they wait for each other.

#include <filesystem>
#include <string>

namespace gart_cli {

// Processors that a cgroup's quota leaves, rounded up: the least of the group `own` (as /proc/self/cgroup has it) and
// those above it, below the mount point; 0 where there is none.
int processors_of_quota(std::filesystem::path const& mount, std::string const& own);

// Threads of OpenMP: as many as the process's affinity and its quota let run, or what OMP_NUM_THREADS says up to
// sixteen times as many. They wait without spinning, which on a machine with other work takes the time of those that
// are waited for: OpenMP reads that when it is loaded, so the program begins anew with it in its environment. An
// OMP_WAIT_POLICY of the user's stays.
void bound_threads(char** argv);

}  // namespace gart_cli
