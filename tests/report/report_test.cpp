#include "sila/report/report.hpp"

#include <gtest/gtest.h>

#include <set>

#include "report/scored.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/config_json.hpp"
#include "sila/io/reports.hpp"
#include "sila/train/episode.hpp"
#include "support/scratch.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

const EpisodeConfig kConfig;

/// A model of made-up walks and other walks to score it on.
ReportInput made_up() {
  ReportInput input;
  Model previous;
  const auto keep = [&](int number, const Model&, const Episode& episode) {
    const EpisodeReport& report = episode.report;
    nlohmann::ordered_json statistics;
    statistics["change"] = to_json(report.change, previous, episode.model);
    input.stored.episodes.push_back(
        {number, report.tracks, report.seconds, report.size_before, report.size_after, statistics.dump()});
    previous = episode.model;
  };
  input.stored.model = run_episodes({}, testing::corner_walks(60, 1), 20, kConfig, sila_update(kConfig), keep).model;
  input.name = "made up";
  input.scene.name = "a corner";
  input.scene.corners.push_back({"corner", testing::square_frame(), {2.5, 2.5, 2.5}});
  input.tracks = testing::corner_walks(30, 2);
  input.configuration = to_json(kConfig);
  return input;
}

TEST(Report, HasTheModelAndWhatBecameOfThePeople) {
  const ReportInput input = made_up();
  const nlohmann::ordered_json data = report_data(input);
  EXPECT_EQ(data.at("model").at("primitives").size(), input.stored.model.primitives.size());
  EXPECT_EQ(data.at("model").at("transitions").size(), input.stored.model.transitions.size());
  EXPECT_EQ(data.at("episodes").size(), 3u);
  EXPECT_EQ(data.at("drawn_tracks").size(), 30u);
  EXPECT_EQ(data.at("calibration").size(), 5u);
  EXPECT_EQ(data.at("evaluation").at("tracks"), 30);
  ASSERT_FALSE(data.at("played").empty());
  const auto& prediction = data.at("played")[0].at("predictions")[0];
  const std::size_t times = prediction.at("t").size();
  EXPECT_EQ(prediction.at("t").back(), 5.0);
  EXPECT_EQ(prediction.at("truth").size(), 2 * times);
  EXPECT_EQ(prediction.at("constant").size(), 2 * times);
  for (const auto& mode : prediction.at("modes")) {
    EXPECT_EQ(mode.at("path").size(), 2 * times);
    EXPECT_EQ(mode.at("cov").size(), 3 * times);
  }
}

TEST(Report, TheWorstCanBePlayedAndEachPersonIsThereOnce) {
  const nlohmann::ordered_json data = report_data(made_up());
  std::set<std::string> playable, worst;
  for (const auto& played : data.at("played")) playable.insert(played.at("track"));
  double last = 1e9;
  for (const auto& entry : data.at("worst")) {
    EXPECT_TRUE(playable.contains(entry.at("track"))) << entry;
    EXPECT_TRUE(worst.insert(entry.at("track")).second) << entry;
    EXPECT_LE(entry.at("mhd_m"), last);
    EXPECT_FALSE(entry.at("reason").get<std::string>().empty());
    last = entry.at("mhd_m");
  }
  EXPECT_FALSE(worst.empty());
}

TEST(Report, FitsItsLimit) {
  const ReportInput input = made_up();
  ReportLimits limits{.bytes_with_predictor = 0};
  limits.most_bytes = report_data(input, limits).dump().size() / 2;
  nlohmann::ordered_json small = report_data(input, limits);
  small.erase("predictor");
  EXPECT_LE(small.dump().size(), limits.most_bytes);
  EXPECT_FALSE(small.at("played").empty());
}

TEST(Report, HasWhatPredictsOnThePageIfItFits) {
  ReportInput input = made_up();
  const ReportInput empty;
  const nlohmann::ordered_json data = report_data(input);
  EXPECT_EQ(data.at("predictor").at("wasm"),
            tests::content_of(std::string(SILA_TESTS_DIR) + "/../viewer/dist/predictor.wasm.base64"));
  EXPECT_GT(data.at("predictor").at("model").get<std::string>().size(), 1000u);
  const nlohmann::ordered_json small = report_data(input, {.bytes_with_predictor = data.dump().size() - 100});
  EXPECT_FALSE(small.at("predictor").contains("model"));
  EXPECT_GT(small.at("predictor").at("bytes"), small.at("predictor").at("most_bytes"));
  EXPECT_FALSE(report_data(empty).contains("predictor"));
  input.results = std::string(2000, 'x');
  const nlohmann::ordered_json with_results = report_data(input, {.bytes_with_predictor = data.dump().size() + 1000});
  EXPECT_EQ(with_results.at("results"), input.results);
  EXPECT_FALSE(with_results.at("predictor").contains("model"));
}

TEST(Report, WithoutTracksOrSceneShowsTheModelAlone) {
  ReportInput input = made_up();
  input.tracks.clear();
  input.scene = {};
  const nlohmann::ordered_json data = report_data(input);
  EXPECT_FALSE(data.at("scene").at("known"));
  EXPECT_EQ(data.at("scene").at("corners").size(), 1u);
  EXPECT_FALSE(data.contains("played"));
}

TEST(Report, OfAnEmptyModelIsStillAReport) {
  ReportInput input;
  EXPECT_NO_THROW(report_page(report_data(input)));
}

TEST(Report, HasAPictureWithTheCameraOfItsScene) {
  ReportInput input = made_up();
  input.picture = "data:image/png;base64,";
  EXPECT_THROW(report_data(input), std::invalid_argument);
  input.scene.camera = Camera{};
  const nlohmann::ordered_json data = report_data(input);
  EXPECT_EQ(data.at("picture"), input.picture);
  EXPECT_EQ(data.at("camera"), (std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1}));
}

TEST(Page, IsTheBuiltOneWithTheDataInItsPlace) {
  const nlohmann::ordered_json data{{"a", 1}};
  for (const auto& [name, page] :
       std::map<std::string, std::string>{{"report", report_page(data)}, {"editor", editor_page(data)}}) {
    std::string built = tests::content_of(std::string(SILA_TESTS_DIR) + "/../viewer/dist/" + name + ".html");
    const std::string marker = "\"sila-report-data\"";
    const std::size_t at = built.find(marker);
    ASSERT_NE(at, std::string::npos);
    EXPECT_TRUE(page == built.replace(at, marker.size(), "{\"a\":1}")) << name;  // EXPECT_EQ would print the page
  }
}

EditorInput edited_walks() {
  EditorInput input;
  input.scene = made_up().scene;
  input.scene.files.push_back({"a.csv", {}, {}, {}});
  input.file = {{"note", "kept"}, {"camera", {{"image_points", {{1, 2}}}}}, {"files", {{{"path", "b.csv"}}}}};
  input.file_name = "here.json";
  input.tracks = testing::corner_walks(30, 2);
  return input;
}

TEST(Editor, HasTheSceneAndTheTracks) {
  const EditorInput input = edited_walks();
  const nlohmann::ordered_json data = editor_data(input);
  EXPECT_EQ(data.at("tracks").size(), 30u);
  EXPECT_EQ(data.at("tracks_in"), "ground");
  EXPECT_FALSE(data.contains("picture"));
  const auto& file = data.at("file");
  EXPECT_EQ(file.at("note"), "kept");
  EXPECT_EQ(nlohmann::json(file.at("camera")), input.file.at("camera"));
  EXPECT_EQ(file.at("files")[0].at("path"), "b.csv");
  EXPECT_EQ(file.at("corners")[0].at("sidewalk_width_1_m"), 2.5);
  EXPECT_LT(editor_data(input, 10'000).dump().size(), 10'000u);
  EXPECT_THROW(editor_data({}), std::invalid_argument);
}

TEST(Editor, DrawsTracksOfACameraInItsPicture) {
  EditorInput input = edited_walks();
  Eigen::Matrix3d ground_from_image = Eigen::Vector3d(0.1, -0.1, 1.0).asDiagonal();
  ground_from_image(0, 2) = -20.0;
  input.scene.camera = camera_of(ground_from_image);
  const double x_m = editor_data(input).at("tracks")[0][0];
  input.in_picture = true;
  input.picture = "data:image/png;base64,";
  const nlohmann::ordered_json data = editor_data(input);
  EXPECT_NEAR(data.at("tracks")[0][0].get<double>(), 10.0 * (x_m + 20.0), 0.1);
  EXPECT_EQ(data.at("tracks_in"), "picture");
  EXPECT_EQ(data.at("camera").size(), 9u);
  EXPECT_NEAR(data.at("camera")[2].get<double>() / data.at("camera")[0].get<double>(), -200.0, 1e-9);
  EXPECT_EQ(data.at("picture"), input.picture);
}

TEST(Picture, IsADataUrlOfAPngOrJpeg) {
  const tests::ScratchFolder folder;
  const auto url_of = [&](const std::string& bytes) { return picture_url(folder.write("picture", bytes)); };
  EXPECT_EQ(url_of("\x89PNG\r\n\x1a\nabc"), "data:image/png;base64,iVBORw0KGgphYmM=");
  EXPECT_EQ(url_of("\xff\xd8\xff"), "data:image/jpeg;base64,/9j/");
  EXPECT_EQ(url_of("\xff\xd8\xff\xe0"), "data:image/jpeg;base64,/9j/4A==");
  EXPECT_THROW(url_of("GIF89a"), FormatError);
  EXPECT_THROW(url_of(""), FormatError);
  EXPECT_THROW(picture_url(folder / "none.png"), FormatError);
}

TEST(Page, CannotBeLeftByItsData) {
  const std::string page = report_page({{"name", "</script><script>alert(1)</script>"}, {"bytes", "\xff\xfe"}});
  EXPECT_EQ(page.find("alert(1)</script>"), std::string::npos);
  EXPECT_NE(page.find("\\u003c/script>\\u003cscript>alert(1)"), std::string::npos);
}

ScoredPrediction scored_walk(const std::vector<Vector2>& observed_m, const std::vector<Vector2>& truth_m,
                             const std::vector<Vector2>& expected_m) {
  ScoredPrediction scored;
  scored.observed_m = observed_m;
  scored.truth_m = truth_m;
  scored.constant_m = expected_m;
  scored.prediction.modes.push_back(
      {1.0, expected_m, std::vector<Matrix2>(expected_m.size(), Matrix2::Identity()), {}});
  scored.model = scored.constant = measure(scored.prediction, truth_m, truth_m.size());
  return scored;
}

std::string reason(const ScoredPrediction& scored) {
  return reason_of(scored, 0.2);
}

TEST(Reason, SaysWhatThePersonDid) {
  const std::vector<Vector2> east{{-3, 0}, {-2, 0}, {-1, 0}, {0, 0}}, ahead{{1, 0}, {2, 0}, {3, 0}, {4, 0}};
  const std::vector<Vector2> still{{0, 0}, {0, 0}, {0, 0.1}, {0, 0}}, here{{0, 0}, {0, 0}, {0, 0}, {0, 0}};
  EXPECT_EQ(reason(scored_walk(still, ahead, here)), "stood and set off");
  EXPECT_EQ(reason(scored_walk(east, {{0.2, 0}, {0.3, 0}, {0.3, 0}, {0.3, 0}}, ahead)), "stopped");
  const std::vector<Vector2> left{{0, 1}, {0, 2}, {0, 3}, {0, 4}};
  EXPECT_EQ(reason(scored_walk(east, left, ahead)), "turned by 72 degrees, as no mode did");
  EXPECT_EQ(reason(scored_walk(east, {{2, 0}, {4, 0}, {6, 0}, {8, 0}}, ahead)),
            "walked faster: 6.0 m instead of 3.0 m at its observed speed");
  EXPECT_EQ(reason(scored_walk(still, {{0.4, 0}, {0.6, 0}, {0.8, 0}, {1, 0}}, here)),
            "walked faster: 0.6 m instead of 0.0 m at its observed speed");
  EXPECT_EQ(reason(scored_walk(east, left, {{1, 0}, {2, 0}, {2, 1}, {2, 2}})),
            "turned by 72 degrees, but not where a mode did");
  ScoredPrediction novel = scored_walk(east, left, ahead);
  novel.prediction.novelty = 0.8;
  EXPECT_EQ(reason(novel), "walked where few had walked (novelty 80 %)");
  ScoredPrediction foreseen = scored_walk(east, left, ahead);
  foreseen.prediction.modes[0].weight = 0.9;
  foreseen.prediction.modes.push_back({0.1, left, std::vector<Matrix2>(4, Matrix2::Identity()), {}});
  foreseen.model = measure(foreseen.prediction, foreseen.truth_m, 4);
  EXPECT_EQ(reason(foreseen), "followed a mode that had a weight of 10.0 %");
}

TEST(Reliability, CountsTruthsInsideTheStatedRegions) {
  std::vector<ScoredPrediction> scored(4);
  for (std::size_t i = 0; i < 4; ++i) {
    Metrics metrics;  // the first truth is in every region, the last in the widest only
    for (std::size_t p = 0; p < metrics.coverage.size(); ++p) metrics.coverage[p] = p >= i ? 1.0 : 0.0;
    scored[i].horizons = {metrics};
  }
  const nlohmann::ordered_json diagrams = reliability_json(scored, 1.0);
  ASSERT_EQ(diagrams.size(), 1u);
  EXPECT_EQ(diagrams[0]["horizon_s"], 1.0);
  EXPECT_EQ(diagrams[0]["nominal"], (std::vector<double>{0.25, 0.5, 0.75, 0.9}));
  EXPECT_EQ(diagrams[0]["observed"], (std::vector<double>{0.25, 0.5, 0.75, 1.0}));
}

}  // namespace
}  // namespace sila
