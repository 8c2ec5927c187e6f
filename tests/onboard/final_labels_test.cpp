// Final labels of keyframes evicted from the window
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// What was said of every keyframe, at once and at last.
struct Labels {
  std::map<std::uint32_t, Score> online;
  std::map<std::uint32_t, Score> final;
  std::map<std::uint32_t, RelabelledKeyframe> relabelled;
};

/// A scene seen from a robot at the origin, and all that became of it.
class Replay {
 public:
  Replay(const Scene& scene, const PipelineConfig& config) : scene_(scene), pipeline_(config) {}

  Labels run(int scan_count) {
    for (int i = 0; i < scan_count; ++i) {
      scans_.push_back(scene_.scan(pose_of(static_cast<std::size_t>(i)), 0.1 * i));
      take(pipeline_->add_scan(scans_.back().view(), pose_of(static_cast<std::size_t>(i)),
                               1 + i * kPeriodNs));
    }
    take(pipeline_->flush());
    while (pipeline_->relabel_next()) relabel();
    return labels_;
  }

 private:
  /// Turned by three of the sensor's columns in every other keyframe, so that none repeats others.
  static Pose pose_of(std::size_t scan) {
    constexpr double kTurnRad = 1.5 * 3.14159265358979 / 180.0;
    return sensor_at(0.0, 0.0, scan / 10 % 2 == 0 ? 0.0 : kTurnRad);
  }

  struct Labelled {
    std::size_t scan;
    std::vector<PointLabel> labels;
  };

  void take(const ScanResult& result) {
    REQUIRE(result.error.code == ErrorCode::kOk);
    if (!result.keyframe_ready) return;
    relabel();
    const KeyframeView& view = pipeline_->keyframe();
    for (std::size_t s = 0; s < view.scans.size(); ++s) {
      const std::size_t scan = view.scans[s].scan_index;
      Labelled labelled{scan, std::vector<PointLabel>(scans_[scan].points.size())};
      (void)pipeline_->labels(s, labelled.labels);
      labels_.online[view.sequence].add(scans_[scan], labelled.labels);
      kept_[view.sequence].push_back(std::move(labelled));
    }
  }

  void relabel() {
    const RelabelledKeyframe& relabelled = pipeline_->keyframe().relabelled;
    if (!relabelled.available) return;
    REQUIRE(kept_.count(relabelled.sequence) == 1);
    labels_.relabelled[relabelled.sequence] = relabelled;
    for (Labelled& scan : kept_[relabelled.sequence]) {
      (void)pipeline_->relabel(scans_[scan.scan].view(), pose_of(scan.scan), scan.labels);
      labels_.final[relabelled.sequence].add(scans_[scan.scan], scan.labels);
    }
  }

  const Scene& scene_;
  OwnedPipeline pipeline_;
  std::vector<LabelledScan> scans_;
  std::map<std::uint32_t, std::vector<Labelled>> kept_;
  Labels labels_;
};

PipelineConfig short_window() {
  PipelineConfig config = small_config();
  config.removal.window = 4;
  return config;
}

Scene walls() {
  Scene scene;
  scene.boxes = {standing_box({0.0, 12.0, 3.0}, {40.0, 0.3, 3.0}),
                 standing_box({0.0, -12.0, 3.0}, {40.0, 0.3, 3.0})};
  return scene;
}

/// Somebody stands there for two seconds, then walks off.
Scene walls_and_waiting() {
  Scene scene = walls();
  scene.boxes.push_back(
      {[](double t) { return Eigen::Vector3d(6.0 + 2.0 * std::max(0.0, t - 2.0), 4.0, 0.9); },
       {0.3, 0.3, 0.9},
       Truth::kDynamic});
  return scene;
}

}  // namespace

TEST_CASE("a person that waited and then walked off is removed at the waiting position",
          "[final labels]") {
  const Scene scene = walls_and_waiting();
  const Labels said = Replay(scene, short_window()).run(100);
  // Undecidable online: in the first two keyframes the person stood.
  CHECK(said.online.at(0).dynamic_right == 0);
  CHECK(said.final.at(0).dynamic_percent() > 80.0);
  CHECK(said.final.at(1).dynamic_percent() > 80.0);
  for (const auto& [sequence, score] : said.final) CHECK(score.static_percent() > 99.5);
}

TEST_CASE("a keyframe is relabelled once, when it is evicted from the window or at the end",
          "[final labels]") {
  const Scene scene = walls();
  const Labels said = Replay(scene, short_window()).run(95);
  REQUIRE(said.online.size() == 10);
  REQUIRE(said.relabelled.size() == 10);
  for (const auto& [sequence, relabelled] : said.relabelled) {
    CHECK(relabelled.later_keyframes == std::min(4U, 9U - sequence));
  }
}

TEST_CASE("in a static scene no label changes", "[final labels]") {
  const Scene scene = walls();
  const Labels said = Replay(scene, short_window()).run(100);
  for (const auto& [sequence, relabelled] : said.relabelled) {
    CHECK(relabelled.cells_now_dynamic == 0);
    CHECK(relabelled.cells_now_static == 0);
  }
}

TEST_CASE("relabelling can be turned off and then takes no memory", "[final labels]") {
  PipelineConfig config = short_window();
  const std::size_t with = Pipeline::required_bytes(config);
  config.removal.final_labels = false;
  CHECK(Pipeline::required_bytes(config) < with);
  const Scene scene = walls_and_waiting();
  CHECK(Replay(scene, config).run(100).relabelled.empty());
}

TEST_CASE("labels of a scan that does not fit stay as they are", "[final labels]") {
  OwnedPipeline pipeline(short_window());
  std::vector<PointLabel> labels(3, PointLabel::kStatic);
  const LabelledScan scan = walls().scan(sensor_at(0.0, 0.0), 0.0);
  // Nothing has been relabelled yet, and there are fewer labels than points.
  CHECK(pipeline->relabel(scan.view(), Pose{}, labels) == 0);
  CHECK_FALSE(pipeline->relabel_next());
  CHECK_FALSE(pipeline->keyframe().relabelled.available);
}

namespace {

using Points = std::vector<Eigen::Vector3f>;

/// One scan per keyframe; what counts is which scans saw a post of one cell, and which saw through
/// where it stands.
PipelineConfig one_cell_config() {
  PipelineConfig config = single_scans();
  config.free_space.full_weight_range_m = 0.0F;
  config.removal.components = false;
  config.removal.log_odds_weakly_occupied = 0.0F;
  return config;
}

const Eigen::Vector3f kPost(6.1F, 0.1F, -0.5F);

/// A keyframe of each of these scans; returns the last one.
const KeyframeView& add_scans(Pipeline& pipeline, const std::vector<Points>& scans) {
  std::int64_t stamp_ns = 1;
  for (const Points& points : scans) {
    REQUIRE(pipeline.add_scan(view_of(points), Pose{}, stamp_ns += kPeriodNs).keyframe_ready);
  }
  return pipeline.keyframe();
}

/// 'p': the scan saw the post, 'w': the wall behind where it stands.
std::vector<Points> scans_of(const std::string& letters) {
  std::vector<Points> scans;
  for (const char letter : letters) {
    scans.push_back(letter == 'p' ? Points{kPost} : wall_ahead(-3.0F, 3.0F));
  }
  return scans;
}

/// What became of a keyframe when all scans had been seen.
RelabelledKeyframe relabelled(const PipelineConfig& config, const std::string& scans,
                              std::uint32_t sequence) {
  OwnedPipeline pipeline(config);
  add_scans(*pipeline, scans_of(scans));
  for (std::uint32_t i = 0; i <= sequence; ++i) REQUIRE(pipeline->relabel_next());
  const RelabelledKeyframe result = pipeline->keyframe().relabelled;
  REQUIRE(result.available);
  REQUIRE(result.sequence == sequence);
  CHECK(result.later_keyframes == scans.size() - 1 - sequence);
  return result;
}

}  // namespace

TEST_CASE("a kept cell is removed if more speaks against it than one observation outweighs",
          "[final labels]") {
  PipelineConfig config = one_cell_config();
  // Seen through once.
  config.removal.log_odds_free = config.removal.log_odds_occupied;
  CHECK(relabelled(config, "pw", 0).cells_now_dynamic == 0);
  config.removal.log_odds_free += 0.001F;
  CHECK(relabelled(config, "pw", 0).cells_now_dynamic == 1);
  // Observed once and seen through once.
  config.removal.log_odds_free = 2.0F * config.removal.log_odds_occupied;
  CHECK(relabelled(config, "ppw", 0).cells_now_dynamic == 0);
  config.removal.log_odds_free += 0.001F;
  CHECK(relabelled(config, "ppw", 0).cells_now_dynamic == 1);
  CHECK(relabelled(config, "ppw", 0).cells_now_static == 0);
}

TEST_CASE("a removed cell is kept after all if more speaks for it than its label against it",
          "[final labels]") {
  PipelineConfig config = one_cell_config();
  {
    OwnedPipeline pipeline(config);
    REQUIRE(add_scans(*pipeline, scans_of("wp")).dynamic_cells.size() == 1);
  }
  config.removal.log_odds_occupied = EvidenceDefaults::kPriorLogOdds;
  CHECK(relabelled(config, "wpp", 1).cells_now_static == 0);
  config.removal.log_odds_occupied += 0.001F;
  CHECK(relabelled(config, "wpp", 1).cells_now_static == 1);
  CHECK(relabelled(config, "wpp", 1).cells_now_dynamic == 0);
}

TEST_CASE("three later observations of a kept cell outweigh every image", "[final labels]") {
  PipelineConfig config = one_cell_config();
  config.removal.log_odds_free = 5.0F;
  CHECK(relabelled(config, "pppwww", 0).cells_now_dynamic == 1);
  CHECK(relabelled(config, "ppppwww", 0).cells_now_dynamic == 0);
}

namespace {

/// Poles of a cell each, 20 m to 60 m away, none of them in another one's block.
Points poles() {
  Points points;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 10; ++y) {
      points.emplace_back(-20.1F - 2.0F * static_cast<float>(x),
                          -10.1F + 2.0F * static_cast<float>(y), -0.5F);
    }
  }
  return points;
}

/// The first keyframe sees a post and, in the same block of cells, a board beside it. So many
/// keyframes then see the board only, and the last one what is behind the post but not the board.
std::uint32_t cells_now_dynamic(const PipelineConfig& config, const Points& post,
                                std::uint32_t boards) {
  const Eigen::Vector3f board(6.1F, 0.7F, -0.5F);
  std::vector<Points> scans{post};
  scans[0].push_back(board);
  scans.insert(scans.end(), boards, Points{board});
  scans.push_back(wall_ahead(-3.0F, 0.8F));
  OwnedPipeline pipeline(config);
  add_scans(*pipeline, scans);
  REQUIRE(pipeline->relabel_next());
  REQUIRE(pipeline->keyframe().relabelled.sequence == 0);
  return pipeline->keyframe().relabelled.cells_now_dynamic;
}

}  // namespace

TEST_CASE("without room for all of their blocks, keyframes are relabelled near by",
          "[final labels]") {
  PipelineConfig config = one_cell_config();
  config.removal.window = 6;
  // Room for 4 x 1024 / 4 blocks, of a window and a keyframe with 200 poles and a wall each.
  config.voxel.max_cells = 1024;
  config.voxel.max_window_blocks = 2048;
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  for (int i = 0; i < 4; ++i) {
    Points points = i == 0 ? Points{kPost} : wall_ahead(-3.0F, 3.0F);
    const Points far = poles();
    points.insert(points.begin(), far.begin(), far.end());
    REQUIRE(pipeline->add_scan(view_of(points), Pose{}, (i + 1) * kPeriodNs).keyframe_ready);
    // So many poles are too far away, and counted.
    const std::uint64_t left_out =
        pipeline->keyframe().statistics->dropped_by(DropCause::kEvidenceFull);
    CHECK(left_out > 40);
    CHECK(left_out < 200);
  }
  for (std::uint32_t keyframe = 0; keyframe < 4; ++keyframe) {
    REQUIRE(pipeline->relabel_next());
    const RelabelledKeyframe& relabelled = pipeline->keyframe().relabelled;
    CHECK(relabelled.sequence == keyframe);
    CHECK(relabelled.cells_now_dynamic == (keyframe == 0 ? 1 : 0));
  }
}

TEST_CASE("cells that stay static speak for the others of their block", "[final labels]") {
  PipelineConfig config = one_cell_config();
  REQUIRE(config.removal.log_odds_occupied == 0.425F);
  config.removal.log_odds_free = 2.0F;
  // 2.0 - 3 x 0.425 against 0.425, and 2.0 - 4 x 0.425.
  CHECK(cells_now_dynamic(config, {{6.1F, 0.1F, -0.5F}}, 3) == 1);
  CHECK(cells_now_dynamic(config, {{6.1F, 0.1F, -0.5F}}, 4) == 0);
}

TEST_CASE("a confirmed static cell stays although its block is removed", "[final labels]") {
  PipelineConfig config = one_cell_config();
  Points post;
  for (const float x : {6.1F, 6.3F}) {
    for (const float z : {-0.1F, -0.3F, -0.5F, -0.7F}) post.emplace_back(x, 0.1F, z);
  }
  // The board was observed twice more: 2 x 0.425.
  config.removal.confirmed_static_log_odds = 0.85F;
  CHECK(cells_now_dynamic(config, post, 2) == 8);
  config.removal.confirmed_static_log_odds = 0.851F;
  CHECK(cells_now_dynamic(config, post, 2) == 9);
}

TEST_CASE("labels of the points of a relabelled cell change, unknown ones do not",
          "[final labels]") {
  OwnedPipeline pipeline(one_cell_config());
  add_scans(*pipeline, scans_of("pww"));
  REQUIRE(pipeline->relabel_next());
  REQUIRE(pipeline->keyframe().relabelled.cells_now_dynamic == 1);
  const Eigen::Vector3f beside = kPost + Eigen::Vector3f(0.0F, 0.2F, 0.0F);
  const Points points{kPost, kPost, kPost, beside, kPost};
  const PointView view = view_of(points);
  std::vector<PointLabel> labels{PointLabel::kStatic, PointLabel::kUnknown, PointLabel::kDynamic,
                                 PointLabel::kStatic};
  CHECK(pipeline->relabel(view, Pose{}, labels) == 1);
  CHECK(labels == std::vector<PointLabel>{PointLabel::kDynamic, PointLabel::kUnknown,
                                          PointLabel::kDynamic, PointLabel::kStatic});
  // The pose of the scan places its points.
  Pose aside;
  aside.translation.y() = 0.2;
  labels.assign(5, PointLabel::kStatic);
  CHECK(pipeline->relabel(view, aside, labels) == 0);
  // The next keyframe has nothing there.
  REQUIRE(pipeline->relabel_next());
  CHECK(pipeline->relabel(view, Pose{}, labels) == 0);
}

TEST_CASE("nothing is relabelled early while a keyframe is open", "[final labels]") {
  PipelineConfig config = one_cell_config();
  config.keyframe.scans = 2;
  OwnedPipeline pipeline(config);
  for (std::int64_t i = 1; i <= 3; ++i) {
    REQUIRE(pipeline->add_scan(view_of({kPost}), Pose{}, i * kPeriodNs).error.ok());
  }
  CHECK_FALSE(pipeline->relabel_next());
  REQUIRE(pipeline->flush().keyframe_ready);
  CHECK(pipeline->relabel_next());
  CHECK(pipeline->keyframe().relabelled.sequence == 0);
  CHECK(pipeline->relabel_next());
  CHECK(pipeline->keyframe().relabelled.sequence == 1);
  CHECK_FALSE(pipeline->relabel_next());
  CHECK_FALSE(pipeline->keyframe().relabelled.available);
}
