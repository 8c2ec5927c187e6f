// Tests of handles of shared memory over LCM.
#include "ports/lcm/doorbell.hpp"

#include <unistd.h>

#include <lcm/lcm-cpp.hpp>

#include "ports/shared_memory/reader.hpp"
#include "ports/shared_memory/writer.hpp"
#include "tests/ports/lcm/damage.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::lcm_port;
using namespace std::chrono_literals;

namespace {

/// A topic with a writer and a reader, and LCM within this process beside it.
struct Scene {
  std::string name = "doorbell" + std::to_string(::getpid());
  std::shared_ptr<lcm::LCM> link = std::make_shared<lcm::LCM>("memq://");
  shared_memory::Writer writer;
  shared_memory::Reader reader;
  Doorbell doorbell{link, name, "keyframe"};
  DoorbellListener listener{link, name, "keyframe"};

  Scene() {
    REQUIRE(writer.open(name, "keyframe", {.message_bytes = 64}).ok);
    REQUIRE(reader.open(name, "keyframe").ok);
  }
  ~Scene() { writer.remove(); }

  std::uint32_t publish(std::uint8_t mark) {
    writer.loan()[0] = std::byte{mark};
    return writer.publish(1, 5);
  }
  void put(const std::vector<std::uint8_t>& bytes) {
    link->publish(std::string(kHandleChannel), bytes.data(),
                  static_cast<unsigned int>(bytes.size()));
  }
};

}  // namespace

TEST_CASE("a consumer that waits for the handle finds the message in the ring") {
  Scene scene;
  CHECK_FALSE(scene.listener.wait(1ms));
  REQUIRE(scene.doorbell.ring(scene.publish(7)));
  REQUIRE(scene.listener.wait(10s));
  shared_memory::Sample sample;
  REQUIRE(scene.reader.take(sample) == shared_memory::Taken::kMessage);
  CHECK(sample.bytes()[0] == std::byte{7});
  // One look sees all: handles that came together wake once.
  for (std::uint8_t i = 0; i < 3; ++i) scene.doorbell.ring(scene.publish(i));
  CHECK(scene.listener.wait(10s));
  CHECK_FALSE(scene.listener.wait(1ms));
}

TEST_CASE("a forged handle causes a look at the ring and nothing else") {
  Scene scene;
  scene.publish(1);
  shared_memory::Sample sample;
  REQUIRE(scene.reader.take(sample) == shared_memory::Taken::kMessage);
  const std::uint32_t latest = scene.reader.latest();
  for (const std::uint32_t sequence : {0U, 1U, 77U, 0xFFFFFFFFU}) {
    scene.put(encode(Handle{scene.name, "keyframe", sequence}));
    CHECK(scene.listener.wait(10s));
    shared_memory::Sample none;
    CHECK(scene.reader.take(none) == shared_memory::Taken::kNothing);
  }
  CHECK(scene.reader.latest() == latest);
  CHECK(scene.reader.missed() == 0);
  CHECK(sample.intact());
  CHECK(sample.bytes()[0] == std::byte{1});
}

TEST_CASE("handles of other topics, and what is no handle, wake nobody") {
  Scene scene;
  scene.put(encode(Handle{scene.name, "labels", 1}));
  scene.put(encode(Handle{"another", "keyframe", 1}));
  CHECK_FALSE(scene.listener.wait(1ms));
  CHECK(scene.listener.malformed() == 0);
  scene.put({1, 2, 3});
  CHECK_FALSE(scene.listener.wait(1ms));
  CHECK(scene.listener.malformed() == 1);
}

TEST_CASE("handles arrive as they were sent; damaged ones are refused") {
  const std::vector<std::uint8_t> bytes = encode(Handle{"robot7", "keyframe", 0xFFFFFFFEU});
  const auto handle = decode_handle(bytes);
  REQUIRE(handle);
  CHECK(handle->share == "robot7");
  CHECK(handle->topic == "keyframe");
  CHECK(handle->sequence == 0xFFFFFFFEU);
  lcm_test::check_only_the_original_passes(bytes, decode_handle);
}

TEST_CASE("impossible names are refused") {
  CHECK_THROWS_AS(encode(Handle{"", "keyframe", 1}), std::invalid_argument);
  CHECK_THROWS_AS(encode(Handle{"robot7", std::string(41, 'x'), 1}), std::invalid_argument);
  CHECK_THROWS_AS(Doorbell("memq://", "", "keyframe"), std::invalid_argument);
}
