// Of which degrees the compiled configurations are that ranks train by.
#include <gart/runtime/request.hpp>

#include <doctest/doctest.h>

#include <map>
#include <set>
#include <string>

using namespace gart;

TEST_CASE("where ranks train, they do so at every degree, so that a choice of bands leaves no GPU idle") {
  std::map<std::string, std::set<int>> degrees;
  for (configuration_info const& c : compiled_configurations())
    if (c.ranks) degrees[std::string(to_string(c.backend)) + " " + c.backward].insert(c.sh_degree);
  CHECK(degrees.size() >= 2);  // with sums in a fixed order and without
  for (auto const& [name, there] : degrees) {
    CAPTURE(name);
    CHECK(there == std::set<int>{0, 1, 2, 3});
  }
}
