// Tests of a build without libnats.
#include <fstream>
#include <iterator>

#include "ports/nats/downlink.hpp"
#include "ports/nats/fleet_status.hpp"
#include "ports/nats/job_board.hpp"
#include "ports/nats/uplink.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "unimapper/wire/memory_storage.hpp"

using namespace unimapper;
using namespace unimapper::nats_port;
using Catch::Matchers::Contains;

TEST_CASE("without libnats every entry says so, and the program does not load it", "[nats]") {
  const TemporaryDirectory folder;
  const store::StoreLock held(folder.path(), "a test");
  wire::MemoryStorage storage(1000);
  CHECK_THROWS_WITH(start_uplink({}, held), Contains("lacks NATS"));
  CHECK_THROWS_WITH(start_downlink({}, storage), Contains("lacks NATS"));
  CHECK_THROWS_WITH(fleet_status({}), Contains("lacks NATS"));
  CHECK_THROWS_WITH(open_board({}, {}), Contains("lacks NATS"));
  CHECK_THROWS_WITH(open_source({}, ""), Contains("lacks NATS"));
  std::ifstream maps("/proc/self/maps");
  const std::string loaded(std::istreambuf_iterator<char>(maps), {});
  CHECK_THAT(loaded, Contains("libsqlite3") && !Contains("libnats"));
}
