#pragma once
// How many threads a command's parallel loops have, and how they wait for each other.

#include <filesystem>
#include <string>

namespace gart_cli {

// Processors that cgroup quotas leave, rounded up; 0 for none. It is the least over the group `own` (from
// /proc/self/cgroup) and its parents, below the mount point.
int processors_of_quota(std::filesystem::path const& mount, std::string const& own);

// Threads of OpenMP: as many as affinity and quota allow, or OMP_NUM_THREADS, up to sixteen times as many. They wait
// without spinning: on a machine with other work, spinning takes the time of the threads waited for. OpenMP reads the
// setting when it is loaded, so the program starts itself again with it in its environment. An OMP_WAIT_POLICY of the
// user's stays.
void bound_threads(char** argv);

}  // namespace gart_cli
