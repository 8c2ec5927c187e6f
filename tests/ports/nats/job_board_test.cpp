// Tests of jobs and answers on a board that a real server keeps.
#include "ports/nats/job_board.hpp"

#include <thread>

#include "tests/ports/nats/server.hpp"

using namespace unimapper::nats_port;
using namespace unimapper::nats_port::nats_test;
using Catch::Matchers::Contains;

namespace {

constexpr std::chrono::milliseconds kSoon{500};
constexpr std::chrono::milliseconds kNow{0};
/// Of workers that are taken for dead.
constexpr std::chrono::milliseconds kShortProgress{150};
const BoardNames kNames{"1_0-5", "site"};

}  // namespace

TEST_CASE("a job goes to one worker, and its answer to the project that asked", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  const auto other = open_board(server.address(), {kNames.version, "another"});
  const auto first = open_source(server.address(), kNames.version);
  const auto second = open_source(server.address(), kNames.version);

  CHECK_FALSE(first->next_job(kNow));
  board->put_job("job 1", 0);
  const auto taken = first->next_job(kSoon);
  REQUIRE(taken);
  CHECK(*taken == "job 1");
  CHECK_FALSE(second->next_job(kNow));
  first->tell_progress();
  first->answer("answer 1");
  CHECK(board->next_answer(kSoon) == std::optional<std::string>("answer 1"));
  CHECK_FALSE(board->next_answer(kNow));
  CHECK_FALSE(other->next_answer(kNow));

  const std::vector<std::uint8_t> bytes{1, 2, 3};
  board->put_keyframe("k-1", bytes);
  board->put_keyframe("k-1", bytes);
  CHECK(second->keyframe("k-1") == bytes);
  CHECK_THROWS_AS(second->keyframe("k-2"), NatsError);
}

TEST_CASE("a job that nobody has begun is taken back, one that somebody has is not", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  const auto source = open_source(server.address(), kNames.version);
  const std::uint64_t begun = board->put_job("begun", 0);
  const std::uint64_t last = board->put_job("last", 0);
  REQUIRE(source->next_job(kSoon));
  CHECK(board->take_back(last, 0));
  CHECK_FALSE(board->take_back(last, 0));
  CHECK_FALSE(board->take_back(begun, 0));
  source->answer("answer");
  CHECK_FALSE(source->next_job(kNow));
}

TEST_CASE("a job between others that are gone goes to a worker or is taken back", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  const auto source = open_source(server.address(), kNames.version);
  std::vector<std::uint64_t> numbers;
  for (int i = 0; i < 4; ++i) {
    numbers.push_back(board->put_job("of 7", 7));
    board->put_job("of 8", 8);
    if (i == 0) REQUIRE(source->next_job(kSoon));
  }
  for (const std::size_t i : {3U, 2U}) CHECK(board->take_back(numbers[i], 7));
  source->answer("answer");
  std::size_t given = 0;
  for (; source->next_job(kSoon); ++given) source->answer("answer");
  CHECK(given + (board->take_back(numbers[1], 7) ? 1 : 0) == 5);
}

TEST_CASE("a worker stays in its lane, then goes to the longest, of equal ones to that beside it",
          "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  const auto source = open_source(server.address(), kNames.version);
  const auto next = [&source] {
    const auto job = source->next_job(kSoon);
    source->answer("answer");
    return job.value_or("none");
  };
  board->put_job("a of 4", 4);
  CHECK(next() == "a of 4");
  board->put_job("b of 4", 4);
  const std::uint64_t last = board->put_job("c of 4", 4);
  board->put_job("of 3", 3);
  board->put_job("of 12", 12);
  CHECK(next() == "b of 4");
  CHECK(board->take_back(last, 4));
  CHECK(next() == "of 3");
  CHECK(next() == "of 12");
  for (const std::uint32_t lane : {3U, 4U, 4U}) board->put_job(std::to_string(lane), lane);
  for (const char* text : {"4", "4", "3"}) CHECK(next() == text);
}

TEST_CASE("a job that another worker has keeps nobody from those of other lanes", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  const auto busy = open_source(server.address(), kNames.version);
  const auto source = open_source(server.address(), kNames.version);
  board->put_job("a of 4", 4);
  REQUIRE(source->next_job(kSoon));
  source->answer("answer");
  board->put_job("b of 4", 4);
  REQUIRE(busy->next_job(kSoon));
  board->put_job("of 7", 7);
  const auto begin = std::chrono::steady_clock::now();
  CHECK(source->next_job(kSoon) == std::optional<std::string>("of 7"));
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(1500));
}

TEST_CASE("workers of another version get no job, and are told for whom jobs wait", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  const auto other = open_source(server.address(), "0_9-4");
  board->put_job("job", 0);
  CHECK_FALSE(other->next_job(kNow));
  CHECK(other->versions_wanted() == std::vector<std::string>{"1_0-5"});
}

TEST_CASE("a merge that waits for an answer hears of it at once", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  board->put_job("job", 0);
  std::thread worker([&] {
    const auto source = open_source(server.address(), kNames.version);
    if (source->next_job(kSoon)) source->answer("answer");
  });
  const auto begin = std::chrono::steady_clock::now();
  const auto answer = board->next_answer(std::chrono::seconds(10));
  worker.join();
  CHECK(answer == std::optional<std::string>("answer"));
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(5));
}

TEST_CASE("a job that ends one worker after another is set aside by the server alone", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  const auto board = open_board(server.address(), kNames);
  const std::uint64_t number = board->put_job("job", 0);
  for (std::uint32_t ended = 0; ended < kMostDeliveries; ++ended) {
    CHECK(board->set_aside().empty());
    const auto source = open_source(server.address(), kNames.version, kShortProgress);
    CHECK(source->next_job(kSoon) == std::optional<std::string>("job"));
  }
  const auto last = open_source(server.address(), kNames.version, kShortProgress);
  std::vector<std::uint64_t> ended;
  for (int tries = 0; ended.empty() && tries < 50; ++tries) {
    CHECK_FALSE(last->next_job(kShortProgress));
    ended = board->set_aside();
  }
  CHECK(ended == std::vector<std::uint64_t>{number});
  CHECK(board->set_aside().empty());
  CHECK(last->versions_wanted().empty());
}

TEST_CASE("a merge and a worker that are killed together leave the next ones their own jobs",
          "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server;
  {
    const auto board = open_board(server.address(), kNames);
    const auto source = open_source(server.address(), kNames.version, kShortProgress);
    board->put_job("answered", 0);
    board->put_job("begun", 0);
    board->put_job("waiting", 0);
    REQUIRE(source->next_job(kSoon));
    source->answer("answer");
    REQUIRE(source->next_job(kSoon));
  }
  const auto board = open_board(server.address(), kNames);
  CHECK(board->next_answer(kSoon) == std::optional<std::string>("answer"));
  const std::uint64_t number = board->put_job("of the next merge", 0);
  const auto source = open_source(server.address(), kNames.version, kShortProgress);
  CHECK(source->next_job(kSoon) == std::optional<std::string>("of the next merge"));
  CHECK_FALSE(board->take_back(number, 0));
  source->answer("another");
  CHECK(board->next_answer(kSoon) == std::optional<std::string>("another"));
  CHECK_FALSE(source->next_job(2 * kShortProgress));
  CHECK(board->set_aside().empty());
}

TEST_CASE("answers outlast a merge and a server that are killed, its jobs the server alone",
          "[nats]") {
  if (!TestServer::is_installed()) return;
  TestServer server;
  {
    const auto board = open_board(server.address(), kNames);
    board->put_job("job 1", 0);
    board->put_job("job 2", 0);
    const auto source = open_source(server.address(), kNames.version);
    REQUIRE(source->next_job(kSoon));
    source->answer("answer 1");
    server.kill();
    CHECK_THROWS_AS(board->put_job("job 3", 0), NatsError);
    CHECK_THROWS_AS(board->next_answer(kNow), NatsError);
    CHECK_THROWS_AS(source->next_job(kNow), NatsError);
  }
  server.start();
  const auto source = open_source(server.address(), kNames.version);
  const auto again = open_board(server.address(), kNames);
  CHECK(again->next_answer(kSoon) == std::optional<std::string>("answer 1"));
  CHECK_FALSE(source->next_job(kNow));
}

TEST_CASE("a job that the server does not take is refused with the remedy", "[nats]") {
  if (!TestServer::is_installed()) return;
  const TestServer server("max_payload: 2000\n");
  const auto board = open_board(server.address(), kNames);
  CHECK_THROWS_WITH(board->put_job(std::string(3000, 'x'), 0), Contains("raise max_payload"));
  board->put_job("small", 0);
}
