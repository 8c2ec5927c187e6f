// Tests of loops that workers verify: jobs, answers, and what happens when either fails
#include "src/apps/fleet/loop_workers.hpp"

#include <deque>
#include <nlohmann/json.hpp>

#include "src/apps/fleet/worker.hpp"
#include "src/merge/loops/loop_fingerprint.hpp"
#include "src/merge/loops/loop_verifier.hpp"
#include "tests/merge/poses.hpp"
#include "tests/merge/synthetic_town.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;
using namespace unimapper::apps;
using namespace unimapper::merge;
using Catch::Matchers::Contains;

namespace {

/// Two short drives along one road, as a base decodes them.
const std::vector<SessionData>& drives() {
  static const std::vector<SessionData> made = [] {
    std::vector<SessionData> sessions;
    for (testing::Drive& drive : testing::same_way({{0.0, 0.0}, {0.5, 0.0}})) {
      for (KeyframeRecord& keyframe : drive.session.keyframes) {
        keyframe = *wire::decode_keyframe(wire::encode_keyframe(keyframe)).record;
      }
      sessions.push_back(std::move(drive.session));
    }
    return sessions;
  }();
  return made;
}

/// A merge of the drives that asks about each keyframe of one with the one beside it, off by `by`.
struct Asked {
  MergeConfig config;
  std::vector<LoopCandidate> candidates;
  std::vector<LoopQuestion> questions;
  KeyframeClouds clouds{drives(), config.registration, 1};
  std::size_t verified_here = 0;

  Asked() {
    config.threads = 1;
    LoopFingerprints prints(drives(), config);
    const double wrong_m[] = {0.0, 0.3, 0.0, 20.0, 0.2, 0.0};
    for (std::uint32_t k = 0; k < drives()[0].keyframes.size(); ++k) {
      LoopCandidate candidate;
      candidate.match = {0, k};
      candidate.query = {1, k};
      candidate.T_match_query = testing::shifted(wrong_m[k % 6]);
      candidates.push_back(candidate);
      questions.push_back({candidate.query, candidate.match, candidate.T_match_query,
                           prints.of(candidate.query, candidate.match, kDescriptorLimit)});
    }
  }
  std::vector<LoopConstraint> verify(std::span<const std::size_t> positions) {
    verified_here += positions.size();
    std::vector<LoopCandidate> chosen;
    for (const std::size_t i : positions) chosen.push_back(candidates[i]);
    return verify_loops(chosen, kDescriptorLimit, clouds, config);
  }
};

/// Board in memory whose workers work while the caller waits.
struct Board final : nats_port::JobBoard, nats_port::JobSource {
  std::map<std::string, std::vector<std::uint8_t>> keyframes;
  std::deque<std::pair<std::uint64_t, std::string>> jobs;
  std::deque<std::string> answers;
  FleetWorker* worker = nullptr;
  bool ends_workers = false;  ///< every job does
  bool is_broken = false;
  std::uint64_t numbers = 0;
  std::uint64_t progress = 0;
  std::function<void(JobAnswer&)> lie;
  std::function<void(std::string&)> forge;

  void require() const {
    if (is_broken) throw nats_port::NatsError("no server");
  }
  void put_keyframe(const std::string& name, std::span<const std::uint8_t> bytes) override {
    require();
    keyframes[name] = {bytes.begin(), bytes.end()};
  }
  std::uint64_t put_job(const std::string& text, std::uint32_t /*lane*/) override {
    require();
    jobs.emplace_back(++numbers, text);
    return numbers;
  }
  bool take_back(std::uint64_t number, std::uint32_t /*lane*/) override {
    const auto is_it = [number](const auto& job) { return job.first == number; };
    return worker == nullptr && std::erase_if(jobs, is_it) > 0;
  }
  std::vector<std::uint64_t> set_aside() override {
    std::vector<std::uint64_t> ended;
    if (ends_workers) {
      for (const auto& [number, text] : std::exchange(jobs, {})) ended.push_back(number);
    }
    return ended;
  }
  std::optional<std::string> next_answer(std::chrono::milliseconds wait) override {
    require();
    if (answers.empty() && wait.count() > 100 && worker != nullptr) worker->work(*this, wait);
    if (answers.empty()) return std::nullopt;
    std::string text = std::move(answers.front());
    answers.pop_front();
    return text;
  }
  std::optional<std::string> next_job(std::chrono::milliseconds /*wait*/) override {
    if (jobs.empty()) return std::nullopt;
    return jobs.front().second;
  }
  void tell_progress() override { ++progress; }
  void answer(const std::string& text) override {
    jobs.pop_front();
    JobAnswer answer = answer_from(text);
    if (lie) lie(answer);
    answers.push_back(answer_text(answer));
    if (forge) forge(answers.back());
  }
  std::vector<std::uint8_t> keyframe(const std::string& name) override {
    return keyframes.at(name);
  }
  std::vector<std::string> versions_wanted() override { return {}; }
};

/// A merge with workers, its worker, and what was said.
struct Fleet {
  TemporaryDirectory folder;
  Board board;
  KeyframeFiles files{folder.path(), 1U << 24U};
  FleetWorker worker{"w1", files, 1U << 30U, 1};
  std::vector<std::string> said;
  Asked asked;
  LoopWorkers workers{board, options(), [this](const std::string& text) { said.push_back(text); }};

  static LoopWorkersOptions options() {
    LoopWorkersOptions options;
    options.merge = "m";
    options.sizes = {2, 2, 3};
    options.patience = std::chrono::seconds(0);
    return options;
  }
  std::vector<LoopConstraint> verify() { return verify_by(workers); }
  std::vector<LoopConstraint> verify_by(LoopWorkers& by) {
    const auto publish = [this](KeyframeId k) {
      const KeyframeRecord& keyframe = drives()[k.session].keyframes[k.keyframe];
      const auto bytes = wire::encode_keyframe(keyframe);
      const std::string name = keyframe_name(keyframe.session, keyframe.sequence, bytes);
      board.put_keyframe(name, bytes);
      return name;
    };
    return by.verify(
        drives(), asked.config, publish, asked.questions, kDescriptorLimit,
        [this](std::span<const std::size_t> positions) { return asked.verify(positions); });
  }
};

/// All of an outcome that a merge uses.
std::string text_of(const std::vector<LoopConstraint>& loops) {
  JobAnswer answer;
  for (const LoopConstraint& loop : loops) answer.outcomes.push_back({"", loop});
  return answer_text(answer);
}

const std::string& right() {
  static const std::string text = [] {
    Asked asked;
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < asked.questions.size(); ++i) all.push_back(i);
    return text_of(asked.verify(all));
  }();
  return text;
}

}  // namespace

TEST_CASE("loops that workers verify have the same outcomes to the bit", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  REQUIRE(fleet.asked.questions.size() == 6);
  CHECK(text_of(fleet.verify()) == right());
  CHECK(right().find("overlap before alignment") != std::string::npos);
  CHECK(right().find("\"reason\":\"\"") != std::string::npos);
  CHECK(fleet.said.empty());
  CHECK(fleet.workers.text() == "verified by workers: 6 loops by w1");
  // Of a worker that is not known yet the first loops are compared, then few.
  CHECK(fleet.asked.verified_here == 6);
  CHECK(fleet.board.progress > 3);
  for (int more = 0; more < 3; ++more) CHECK(text_of(fleet.verify()) == right());
  CHECK(fleet.asked.verified_here < 14);
}

TEST_CASE("a merge without workers, or without a server, verifies all itself", "[fleet]") {
  Fleet fleet;
  fleet.board.is_broken = GENERATE(false, true);
  CHECK(text_of(fleet.verify()) == right());
  CHECK(fleet.asked.verified_here == 6);
  CHECK(fleet.board.jobs.empty());
  CHECK(fleet.said.size() == (fleet.board.is_broken ? 1 : 0));
}

TEST_CASE("fewer loops than a large job has are verified where they are asked for", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  LoopWorkersOptions options = Fleet::options();
  options.sizes = {2, 7, 3};
  LoopWorkers workers(fleet.board, options, [](const std::string&) {});
  CHECK(text_of(fleet.verify_by(workers)) == right());
  CHECK(fleet.board.numbers == 0);
  CHECK(fleet.asked.verified_here == 6);
}

TEST_CASE("a worker that answers otherwise is not trusted, and all is verified here", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  const int kind = GENERATE(0, 1, 2, 3, 4);
  fleet.board.lie = [kind](JobAnswer& answer) {
    LoopConstraint& outcome = answer.outcomes.back().outcome;
    if (kind == 0) outcome.T_match_query.translation.x() += 1e-12;
    if (kind == 1) outcome.T_match_query.rotation *= 2.0;
    if (kind == 2) outcome.overlap = 7.0;
    if (kind == 3) answer.outcomes.pop_back();
    if (kind == 4) std::swap(answer.outcomes.front().key, answer.outcomes.back().key);
  };
  CHECK(text_of(fleet.verify()) == right());
  REQUIRE(fleet.said.size() == 1);
  CHECK_THAT(fleet.said[0], Contains("worker w1 is not trusted: "));
}

TEST_CASE("a job that is no text is answered, so that no further worker takes it", "[fleet]") {
  Fleet fleet;
  fleet.board.jobs.emplace_back(1, "{\"name\": \"\xff\xfe");
  CHECK(fleet.worker.work(fleet.board, std::chrono::milliseconds(0)) == 0);
  CHECK(fleet.board.jobs.empty());
  REQUIRE(fleet.board.answers.size() == 1);
  CHECK_THAT(answer_from(fleet.board.answers[0]).fault, Contains("a job is damaged"));
}

TEST_CASE("answers that nobody asked for keep no merge waiting", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  fleet.board.lie = [](JobAnswer& answer) { answer.job = "another"; };
  CHECK(text_of(fleet.verify()) == right());
}

TEST_CASE("what a worker cannot read is verified here, and it says why", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  const auto publish = [&](KeyframeId k) {
    auto bytes = wire::encode_keyframe(drives()[k.session].keyframes[k.keyframe]);
    const std::string name = keyframe_name(drives()[k.session].info.id, k.keyframe, bytes);
    bytes[20] ^= 1U;
    fleet.board.put_keyframe(name, bytes);
    return name;
  };
  CHECK(text_of(fleet.workers.verify(drives(), fleet.asked.config, publish, fleet.asked.questions,
                                     kDescriptorLimit, [&](std::span<const std::size_t> positions) {
                                       return fleet.asked.verify(positions);
                                     })) == right());
  REQUIRE_FALSE(fleet.said.empty());
  CHECK_THAT(fleet.said[0], Contains("is damaged"));
}

TEST_CASE("keyframes or parameters that are not the merge's are answered so", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  for (LoopQuestion& question : fleet.asked.questions) question.fingerprint ^= 1U;
  CHECK(text_of(fleet.verify()) == right());
  REQUIRE_FALSE(fleet.said.empty());
  CHECK_THAT(fleet.said[0], Contains("are not those of the merge"));
  CHECK(fleet.asked.verified_here == 6);
}

TEST_CASE("a job that ended three workers is set aside, with its keyframes", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  fleet.board.ends_workers = true;
  const std::vector<LoopConstraint> loops = fleet.verify();
  for (const LoopConstraint& loop : loops) {
    CHECK_FALSE(loop.decision.accepted);
    CHECK(loop.decision.reason == kSetAside);
  }
  REQUIRE(fleet.said.size() == 3);
  CHECK_THAT(fleet.said[0], Contains("beta:0 - alpha:0, beta:1 - alpha:1"));
}

TEST_CASE("a worker cannot set loops aside", "[fleet]") {
  Fleet fleet;
  fleet.board.worker = &fleet.worker;
  fleet.board.forge = [](std::string& text) {
    auto answer = nlohmann::json::parse(text);
    answer["set_aside"] = true;
    answer["outcomes"] = nlohmann::json::array();
    text = answer.dump();
  };
  CHECK(text_of(fleet.verify()) == right());
  REQUIRE(fleet.said.size() == 1);
  CHECK_THAT(fleet.said[0], Contains("worker w1 is not trusted: "));
}

TEST_CASE("a merge that is killed has not had loops verified in vain", "[fleet]") {
  Asked before;
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < before.questions.size(); ++i) all.push_back(i);
  const std::vector<LoopConstraint> known = before.verify(all);
  Fleet second;
  JobAnswer answer;
  answer.job = "of another merge";
  answer.worker = "w1";
  for (std::size_t i = 0; i < known.size(); ++i) {
    answer.outcomes.push_back({question_key(second.asked.questions[i]), known[i]});
  }
  second.board.answers.push_back(answer_text(answer));
  second.board.answers.push_back("{damaged");
  CHECK(text_of(second.verify()) == right());
  CHECK(second.board.numbers == 0);
  CHECK(second.workers.text() == "verified by workers: 6 loops by w1");
  REQUIRE(second.said.size() == 1);
  CHECK_THAT(second.said[0], Contains("an answer is damaged"));
}

TEST_CASE("questions of a job share keyframes, and each is in one job", "[fleet]") {
  // Three drives along one road, each keyframe with those beside it, asked for in any order.
  std::vector<SessionData> sessions(3);
  for (SessionData& session : sessions) session.keyframes.resize(64);
  std::vector<LoopQuestion> questions;
  for (std::size_t step = 0; step < 64; ++step) {
    const std::size_t k = step * 37 % 64;
    for (const auto& [query, match] : {std::pair(1, 0), {2, 0}, {2, 1}}) {
      questions.push_back({{std::size_t(query), k}, {std::size_t(match), k}, Pose(), step});
      questions.push_back({{std::size_t(query), k}, {std::size_t(match), (k + 63) % 64}, {}, step});
    }
  }
  const auto jobs = make_jobs(sessions, questions, {}, [](KeyframeId) { return "0"; }, {8, 64, 4});
  std::set<std::size_t> positions;
  std::size_t clouds = 0;
  for (const PlacedJob& placed : jobs) {
    positions.insert(placed.positions.begin(), placed.positions.end());
    std::set<KeyframeId> ends;
    for (const LoopQuestion& question : placed.job.questions) {
      ends.insert({question.query, question.match});
    }
    clouds += ends.size();
  }
  CHECK(positions.size() == questions.size());
  CHECK(jobs.size() > 8);
  CHECK(jobs.front().positions.size() == 32);
  CHECK(jobs.back().positions.size() <= 8);
  // One job alone would need 192; each cut of the road costs about three on either side.
  CHECK(clouds < 192 + 6 * jobs.size());
  // Whoever works at a lane needs few that others need.
  std::map<std::uint32_t, std::set<KeyframeId>> of_lanes;
  for (const PlacedJob& placed : jobs) {
    for (const LoopQuestion& question : placed.job.questions) {
      of_lanes[placed.lane].insert({question.query, question.match});
    }
  }
  clouds = 0;
  for (const auto& [lane, ends] : of_lanes) clouds += ends.size();
  CHECK(of_lanes.size() == 4);
  CHECK(clouds < 192 + 6 * of_lanes.size());
  std::vector<std::uint32_t> first;
  for (std::size_t i = 0; i < 5; ++i) first.push_back(jobs[i].lane);
  CHECK(first == std::vector<std::uint32_t>{0, 2, 1, 3, 0});
}

TEST_CASE("a job as text is the same job, and damaged text is none", "[fleet]") {
  Fleet fleet;
  LoopJob common;
  common.name = "j";
  common.limit = kDescriptorLimit;
  const auto jobs = make_jobs(drives(), fleet.asked.questions, common,
                              [](KeyframeId k) { return std::to_string(k.keyframe); }, {4, 4, 1});
  REQUIRE(jobs.size() == 2);
  const std::string text = job_text(jobs[0].job);
  CHECK(job_text(job_from(text)) == text);
  for (std::size_t cut = 0; cut < text.size(); cut += 97) {
    CHECK_THROWS_AS(job_from(text.substr(0, cut)), std::runtime_error);
  }
  for (const char* other : {"[]", "{\"name\":1}", "3", "{\"name\":\"a\",\"merge\":\"b\"}"}) {
    CHECK_THROWS_AS(job_from(other), std::runtime_error);
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    return changed.replace(changed.find(from), from.size(), to);
  };
  const std::string deep = std::string(1'000'000, '[') + std::string(1'000'000, ']');
  CHECK_THROWS_WITH(job_from(with("\"config\":{", "\"config\":" + deep + ",\"c\":{")),
                    Contains("nested too deeply"));
  for (const char* id : {"[-1,0]", "[0.5,0]", "[0,4294967296]", "[1e30,0]"}) {
    CHECK_THROWS_WITH(job_from(with("\"match\":[0,0]", std::string("\"match\":") + id)),
                      Contains("a number of a keyframe is missing"));
  }
}

TEST_CASE("a worker's folder keeps what fits, and what was damaged there is fetched", "[fleet]") {
  const TemporaryDirectory folder;
  std::size_t fetched = 0;
  std::map<std::string, std::vector<std::uint8_t>> there;
  for (std::uint32_t i = 0; i < 10; ++i) {
    const std::vector<std::uint8_t> bytes(100, static_cast<std::uint8_t>(i));
    there[keyframe_name({1, 2}, i, bytes)] = bytes;
  }
  const auto fetch = [&](const std::string& name) {
    ++fetched;
    return there.at(name);
  };
  KeyframeFiles files(folder.path(), 550);
  for (int round = 0; round < 2; ++round) {
    for (const auto& [name, bytes] : there) CHECK(files.get(name, fetch) == bytes);
  }
  std::size_t kept = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    kept += entry.file_size();
  }
  CHECK(kept <= 550);
  CHECK(kept >= 400);
  const std::string& last = there.rbegin()->first;
  fetched = 0;
  (void)files.get(last, fetch);
  CHECK(fetched == 0);
  folder.write(last, "damaged");
  CHECK(files.get(last, fetch) == there[last]);
  CHECK(fetched == 1);
  CHECK_THROWS_AS(files.get("../" + last, fetch), std::runtime_error);
}
