// Tests of keyframes and sessions that are handed on.
#include "ports/store/outbox.hpp"

#include "ports/store/project_writer.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};

/// Marks what comes and says the numbers of robot and keyframe.
std::vector<std::uint32_t> hand_on(Outbox& outbox) {
  Outbox::Marks marks{outbox.next(100, 1U << 20U), {}};
  outbox.mark(marks);
  std::vector<std::uint32_t> numbers;
  for (const OutgoingKeyframe& one : marks.keyframes) {
    numbers.push_back(one.name.session.robot * 100 + one.name.sequence);
  }
  return numbers;
}

using Numbers = std::vector<std::uint32_t>;

}  // namespace

TEST_CASE("keyframes are handed on in the order of commits, until they are marked") {
  const TemporaryDirectory folder;
  Base base(folder.path());
  base.feed(kBeta.id, 1);
  base.advance();
  base.feed(kAlpha.id, 0);
  base.feed(kBeta.id, 0);
  base.advance();
  Outbox outbox(folder.path(), base.store.lock());
  CHECK(outbox.next(2, 1U << 20U).size() == 2);
  CHECK(outbox.next(2, 1).size() == 1);
  CHECK(outbox.next(2, 1).empty());
  CHECK(outbox.unmarked() == 3);
  outbox.start_over();
  CHECK(hand_on(outbox) == Numbers{201, 100, 200});
  base.feed(kAlpha.id, 1);
  base.advance();
  Outbox later(folder.path(), base.store.lock());
  CHECK(hand_on(later) == Numbers{101});
  CHECK(later.unmarked() == 0);
  later.forget_marks();
  CHECK(hand_on(later) == Numbers{201, 100, 200, 101});
}

TEST_CASE("a session that was removed for good and comes again is handed on again") {
  const TemporaryDirectory folder;
  std::optional<Base> base(folder.path());
  base->feed(wire_test::session_stream(kAlpha, 1));
  base->feed(wire_test::session_stream(kBeta, 3));
  base->advance();
  Outbox outbox(folder.path(), base->store.lock());
  CHECK(hand_on(outbox) == Numbers{100, 200, 201, 202});
  std::vector<OutgoingSession> sessions = outbox.sessions();
  REQUIRE(sessions.size() == 2);
  for (OutgoingSession& session : sessions) session.handed_over = {1, 2};
  outbox.mark({{}, sessions});
  CHECK(outbox.sessions()[1].handed_over == std::vector<std::uint8_t>{1, 2});
  base.reset();
  (void)ProjectWriter(folder.path(), "a test").purge("remove --purge beta", "removed", {2});
  CHECK(outbox.unmarked() == 0);
  base.emplace(folder.path());
  base->feed(wire_test::session_stream(kBeta, 2));
  base->advance();
  // In rows that were passed already.
  CHECK(hand_on(outbox).empty());
  CHECK(outbox.unmarked() == 2);
  outbox.start_over();
  CHECK(hand_on(outbox) == Numbers{200, 201});
  CHECK(outbox.sessions()[1].handed_over.empty());
  CHECK(StoreReader(folder.path()).check().empty());
}
