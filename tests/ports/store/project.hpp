// A project of two sessions, and what it says as text.
#pragma once

#include "ports/store/project_writer.hpp"
#include "ports/store/session_import.hpp"
#include "ports/store/transaction.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

namespace unimapper::store::store_test {

inline const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
inline const SessionInfo kBeta{{2, 22}, "beta", "vlp-16"};

inline Pose pose_of(int number) {
  const double angle = 0.1 * number;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
          {1.0 / 3.0 + number, -2.0 * number, 0.1}};
}

/// Makes an epoch of a change.
inline std::optional<Epoch> commit(
    ProjectWriter& writer, const std::string& command,
    const std::function<void(ProjectState&)>& change = [](ProjectState&) {}) {
  return writer.commit(command, [&](ProjectState& state) {
    change(state);
    return std::optional<std::string>(command + " done");
  });
}

inline std::optional<Epoch> commit(ProjectWriter& writer, const MapResult& result) {
  return commit(writer, "merge",
                [&](ProjectState& state) { state.epoch.result = writer.keep(result); });
}

/// Takes messages in, in a transaction that is committed or not.
inline std::map<SessionId, ImportedSession> import_messages(
    Database& database, const std::vector<wire_test::Message>& messages, bool commits = true) {
  Transaction transaction(database);
  SessionImport import(database);
  wire::Receiver receiver({}, import);
  wire_test::feed(receiver, messages);
  receiver.store_all();
  CHECK(import.trouble().empty());
  if (commits) transaction.commit();
  return import.sessions();
}

/// A store with two sessions that a base has received.
struct Received {
  TemporaryDirectory folder;

  Received() {
    Base base(folder.path());
    base.feed(wire_test::session_stream(kAlpha, 5));
    base.feed(wire_test::session_stream(kBeta, 3));
    base.advance();
  }
  [[nodiscard]] std::vector<std::string> check() const {
    return StoreReader(folder.path()).check();
  }
  [[nodiscard]] ProjectState current() const {
    StoreReader reader(folder.path());
    return reader.project().current();
  }
  /// Changes the database under the project's hands; everything the check says then.
  [[nodiscard]] std::string faults_after(const std::string& change) const {
    Database(database_of(folder.path()), Access::kWrite).run(change);
    std::string all;
    for (const std::string& fault : check()) all += fault + "\n";
    return all;
  }
};

/// Likewise with a writer, and sound at the end.
struct Project : Received {
  ProjectWriter writer{folder.path(), "a test"};
  ~Project() { CHECK(check().empty()); }
};

/// Values as text; numbers are equal to the bit where their texts are.
class Words {
 public:
  Words() { out_ << std::hexfloat; }

  template <typename... Values>
  Words& operator()(const Values&... values) {
    (put(values), ...);
    return *this;
  }
  [[nodiscard]] std::string text() const { return out_.str(); }

 private:
  template <typename Value>
  void put(const Value& value) {
    out_ << value << ' ';
  }
  template <int kRows, int kColumns>
  void put(const Eigen::Matrix<double, kRows, kColumns>& matrix) {
    for (const double number : matrix.reshaped()) put(number);
  }
  void put(const Pose& pose) { (*this)(pose.rotation, pose.translation); }
  void put(const KeyframeRow& row) { (*this)(row.session, row.sequence); }
  template <typename Value>
  void put(const std::optional<Value>& value) {
    if (!value) return put("none");
    put(*value);
  }

  std::ostringstream out_;
};

inline std::string text_of(const std::vector<StoredStatement>& statements) {
  Words words;
  for (const StoredStatement& one : statements) {
    words("\n", kind_name(one.kind), one.match, one.query, one.T_match_query);
    for (const StoredPosition& p : one.positions) {
      words("at", p.sequence, p.position, p.point, p.sigma_xy_m, p.sigma_z_m);
    }
  }
  return words.text();
}

inline std::string text_of(const MapResult& result) {
  Words words;
  words(result.parameters);
  for (const SessionResult& s : result.sessions) {
    words("\nsession", s.session, s.state, s.reason, s.T_map_session);
    for (std::size_t k = 0; k < s.sequences.size(); ++k) {
      words(s.sequences[k], s.T_map_keyframe.at(k));
    }
  }
  for (const LoopResult& l : result.loops) {
    words("\nloop", l.query, l.match, l.T_match_query, l.overlap, l.confidence, l.accepted,
          l.by_person, l.reason);
    if (l.accepted) words(l.information);  // of others it is not kept
  }
  for (const PairResult& p : result.pairs) {
    words("\npair", p.match, p.query, p.state, p.reason, p.loops, p.distinct, p.competing,
          p.T_match_query);
  }
  for (const PositionResult& p : result.positions) {
    words("\nposition", p.keyframe, p.position, p.point, p.sigma_xy_m, p.sigma_z_m, p.used,
          p.reason, p.residual);
  }
  if (result.georeference) {
    const GeoreferenceResult& g = *result.georeference;
    words("\nsite", g.origin, g.is_horizontal, g.heading_sigma_rad);
  }
  return words.text();
}

/// Result of a merge of these sessions with an element of every kind.
inline MapResult small_result() {
  MapResult result;
  result.parameters = "{}";
  result.sessions.push_back({1,
                             "central",
                             "its odometry steps by 40.0 m",
                             pose_of(1),
                             {0, 1, 2, 3, 4},
                             {pose_of(0), pose_of(1), pose_of(2), pose_of(3), pose_of(4)}});
  result.sessions.push_back({2, "unconnected", "too few", {}, {0, 2}, {pose_of(5), pose_of(6)}});
  LoopResult loop;
  loop.query = {1, 4};
  loop.match = {1, 0};
  loop.T_match_query = pose_of(7);
  for (int i = 0; i < 36; ++i) loop.information.data()[i] = 1.0 / (i + 3);
  loop.overlap = 0.123456789;
  loop.confidence = 0.9F;
  loop.accepted = true;
  loop.by_person = true;
  loop.reason = "linked by a person";
  result.loops.push_back(loop);
  loop.query = {2, 0};
  loop.accepted = loop.by_person = false;
  loop.reason = "overlap 0.10 (limit 0.45)";
  result.loops.push_back(loop);
  result.pairs.push_back({1, 2, "provisional", "2 loops contradict 3", 9, 3, 2, pose_of(8)});
  result.positions.push_back({{1, 4}, {1.5, 2.5, 0.1}, {0, 0, 1}, 0.5, 2.0, true, "", {1, 2, 3}});
  result.positions.push_back(
      {{1, 0}, {0, 0, 7}, {0, 0, 0}, std::nullopt, 2.0, false, "off", {0, 0, 9}});
  result.georeference = GeoreferenceResult{{691000.0, 0.0, 0.0}, true, std::nullopt};
  return result;
}

}  // namespace unimapper::store::store_test
