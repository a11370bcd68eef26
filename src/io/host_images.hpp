#pragma once
// The images of a capture that the ranks of a host hold once.

#include <gart/comm/host_group.hpp>
#include <gart/io/dataset.hpp>

#include <functional>
#include <vector>

namespace gart::io {

// f() on all ranks of the host; an error of one ends it on all.
void agreed_on_host(host_group& host, std::function<void()> const& f);

// The images of view i lie on rank i % ranks. Afterwards they are on all ranks, in shared memory. False, on all, if it
// is absent.
bool share_on_host(host_group& host, std::vector<dataset_view>& views);

}  // namespace gart::io
