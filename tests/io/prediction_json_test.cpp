#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "sila/core/errors.hpp"
#include "sila/io/reports.hpp"
#include "sila/refine/outcomes.hpp"
#include "support/message_of.hpp"
#include "support/scratch.hpp"

namespace sila {
namespace {

using nlohmann::json;

Matrix2 covariance(double angle_rad, double along_m2, double across_m2) {
  const Matrix2 turn = Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
  return turn * Vector2(along_m2, across_m2).asDiagonal() * turn.transpose();
}

/// By rising size.
Vector2 eigenvalues(const Matrix2& c) {
  const double mean = 0.5 * c.trace(), half_difference = std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1));
  return {mean - half_difference, mean + half_difference};
}

Prediction two_modes() {
  Prediction prediction;
  prediction.t0_s = 1700000000.1234567;
  prediction.times_s = {0.2, 0.6000000000000001};
  prediction.novelty = 1.0 / 3.0;
  prediction.observed_s = 0.6;
  Matrix2 round = 0.25 * Matrix2::Identity(), flat;
  flat << 2.00004, -0.00012, -0.00012, 0.000123456;
  prediction.modes.push_back({2.0 / 3.0, {{1.00049, -0.0004}, {-12.3456, 0.05}}, {round, flat}, {3, 7}});
  prediction.modes.push_back({1.0 / 3.0, {{1, 2}, {3, 4}}, {round, round}, {}, VariantKind::slower});
  prediction.regions = {{0.9, {2.302585, 1e-9}}};
  return prediction;
}

/// A prediction with random modes; covariances of all sizes and shapes from an error of 1 mm.
Prediction random_prediction(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Prediction prediction;
  prediction.t0_s = 1e5 * unit(random);
  for (int j = 1; j <= 25; ++j) prediction.times_s.push_back(j / 30.0);
  prediction.modes.resize(1 + random() % 8);
  double sum = 0.0;
  for (Mode& mode : prediction.modes) sum += mode.weight = std::pow(unit(random), 4.0);
  for (Mode& mode : prediction.modes) {
    mode.weight /= sum;
    for (std::size_t j = 0; j < prediction.times_s.size(); ++j) {
      mode.path_m.emplace_back(200.0 * unit(random) - 100.0, 1e6 * unit(random));
      mode.covariances_m2.push_back(covariance(2.0 * std::numbers::pi * unit(random),
                                               std::pow(10.0, 8.0 * unit(random) - 6.0),
                                               std::pow(10.0, 8.0 * unit(random) - 6.0)));
    }
  }
  std::ranges::sort(prediction.modes, std::greater<>{}, &Mode::weight);
  return prediction;
}

Prediction read_back(const std::string& line) {
  const tests::ScratchFolder folder;
  return read_predictions(folder.write("lines.ndjson", line + "\n")).begin()->second;
}

TEST(PredictionLine, HasTheTimesOnceAndRoundedNumbers) {
  EXPECT_EQ(
      prediction_line("a\"b", two_modes()),
      R"({"track":"a\"b","t0":1700000000.1234567,"observed_s":0.6,"fallback":false,"novelty":0.3333,"t":[0.2,0.6],"modes":[)"
      R"({"weight":0.6667,"t":[0.2,0.6],"x":[1,-12.346],"y":[0,0.05],"cov":[[0.25,0,0.25],[2.00004,-0.00012,0.000123]],)"
      R"("primitives":[3,7],"variant":"expected"},)"
      R"({"weight":0.3333,"x":[1,3],"y":[2,4],"cov":[[0.25,0,0.25],[0.25,0,0.25]],)"
      R"("primitives":[],"variant":"slower"}],"regions":[{"probability":0.9,"level":[2.3026,0]}]})");
}

TEST(PredictionLine, HasTheProbabilityToStartOrToStopUntilEachWholeSecond) {
  Prediction prediction;
  prediction.modes.resize(1);
  prediction.modes[0].weight = 1.0;
  for (int step = 1; step <= 12; ++step) {
    prediction.times_s.push_back(0.2 * step);
    prediction.change_probabilities.push_back(0.05 * step);
    prediction.modes[0].path_m.push_back({0.0, 0.0});
    prediction.modes[0].covariances_m2.push_back(Matrix2::Identity());
  }
  const std::string walks = prediction_line("1", prediction);
  EXPECT_EQ(json::parse(walks).at("stops"), json::parse(R"({"within_s":[1,2,2.4],"probability":[0.25,0.5,0.6]})"));
  prediction.standing = true;
  const std::string stands = prediction_line("1", prediction);
  EXPECT_FALSE(json::parse(stands).contains("stops"));
  EXPECT_FALSE(read_back(walks).standing);
  const Prediction read = read_back(stands);
  EXPECT_TRUE(read.standing);
  ASSERT_EQ(read.change_probabilities.size(), 12u);
  for (std::size_t j = 0; j < 12; ++j)
    EXPECT_NEAR(read.change_probabilities[j], prediction.change_probabilities[j], 1e-12) << j;
  EXPECT_FALSE(json::parse(prediction_line("1", prediction, nullptr, nullptr, {.v1 = true})).contains("starts"));
}

TEST(PredictionLine, OfTheFirstFormHasTheTimesInEachModeAndEveryNumberInFull) {
  const json line = json::parse(prediction_line("1", two_modes(), nullptr, nullptr, {.v1 = true}));
  EXPECT_FALSE(line.contains("t"));
  EXPECT_EQ(line.at("modes").at(1).at("t"), json::parse("[0.2,0.6000000000000001]"));
  EXPECT_EQ(line.at("modes").at(0).at("weight"), 2.0 / 3.0);
}

TEST(PredictionLine, LeavesCovariancesOutIfAsked) {
  const std::string whole = prediction_line("1", two_modes());
  const json line = json::parse(prediction_line("1", two_modes(), nullptr, nullptr, {.covariances = false}));
  json expected = json::parse(whole);
  for (json& mode : expected.at("modes")) EXPECT_EQ(mode.erase("cov"), 1U);
  EXPECT_EQ(line, expected);
  EXPECT_TRUE(says(message_of<FormatError>([&] { read_back(line.dump()); }), "cov"));
}

TEST(PredictionLine, RoundsWeightsSoThatTheySumToOneInOrder) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const Prediction prediction = random_prediction(random);
    const LineFormat format{.digits = 1 + trial % 7};
    const Prediction read = read_back(prediction_line("1", prediction, nullptr, nullptr, format));
    double sum = 0.0;
    for (std::size_t m = 0; m < read.modes.size(); ++m) {
      sum += read.modes[m].weight;
      EXPECT_NEAR(read.modes[m].weight, prediction.modes[m].weight, std::pow(0.1, format.digits + 1));
    }
    EXPECT_NEAR(sum, 1.0, 1e-12) << "trial " << trial;
    EXPECT_TRUE(std::ranges::is_sorted(read.modes, std::greater<>{}, &Mode::weight)) << "trial " << trial;
  }
}

TEST(PredictionLine, KeepsCovariancesPositiveDefiniteToAHundredth) {
  std::mt19937_64 random(6);
  for (int trial = 0; trial < 50; ++trial) {
    const Prediction prediction = random_prediction(random);
    const Prediction read = read_back(prediction_line("1", prediction, nullptr, nullptr, {.digits = 1 + trial % 5}));
    for (std::size_t m = 0; m < read.modes.size(); ++m) {
      for (std::size_t j = 0; j < read.times_s.size(); ++j) {
        const Vector2 truth = eigenvalues(prediction.modes[m].covariances_m2[j]);
        const Vector2 found = eigenvalues(read.modes[m].covariances_m2[j]);
        EXPECT_LE((found - truth).cwiseAbs().maxCoeff(), 0.0101 * truth.minCoeff()) << "trial " << trial;
      }
    }
  }
}

TEST(PredictionLine, InFullOrOfTheFirstFormReadsBackBitForBit) {
  std::mt19937_64 random(7);
  for (const LineFormat& format : {LineFormat{.digits = 17}, LineFormat{.v1 = true}}) {
    const Prediction prediction = random_prediction(random);
    const Prediction read = read_back(prediction_line("1", prediction, nullptr, nullptr, format));
    EXPECT_EQ(read.t0_s, prediction.t0_s);
    EXPECT_EQ(read.times_s, prediction.times_s);
    ASSERT_EQ(read.modes.size(), prediction.modes.size());
    for (std::size_t m = 0; m < read.modes.size(); ++m) {
      EXPECT_EQ(read.modes[m].weight, prediction.modes[m].weight);
      EXPECT_EQ(read.modes[m].path_m, prediction.modes[m].path_m);
      for (std::size_t j = 0; j < read.times_s.size(); ++j)
        EXPECT_EQ(read.modes[m].covariances_m2[j](0, 1), prediction.modes[m].covariances_m2[j](0, 1));
    }
  }
}

TEST(PredictionLine, StaysJsonWhateverTheTrackAndTheNumbersAre) {
  Prediction prediction = two_modes();
  prediction.modes[0].path_m[0] = {std::nan(""), -1e300};
  prediction.modes[0].covariances_m2[0] = Matrix2::Ones() / 3.0;  // singular: in full
  const json line = json::parse(prediction_line("\xff\n", prediction));
  EXPECT_EQ(line.at("track"), "\xEF\xBF\xBD\n");
  EXPECT_TRUE(line.at("modes").at(0).at("x").at(0).is_null());
  EXPECT_EQ(line.at("modes").at(0).at("y").at(0), -1e300);
  EXPECT_EQ(line.at("modes").at(0).at("cov").at(0).at(2), 1.0 / 3.0);
}

TEST(PredictionLine, RefusesDigitsThatADoubleHasNot) {
  for (const int digits : {0, 18})
    EXPECT_THROW(prediction_line("1", two_modes(), nullptr, nullptr, {.digits = digits}), std::invalid_argument);
}

std::string with_changes(const std::vector<double>& within_s, const std::vector<double>& probability) {
  json line = json::parse(prediction_line("1", two_modes()));
  line["stops"] = {{"within_s", within_s}, {"probability", probability}};
  return line.dump();
}

/// A line with another value at a place.
std::string with(const char* place, const json& value) {
  json line = json::parse(prediction_line("1", two_modes()));
  line[json::json_pointer(place)] = value;
  return line.dump();
}

TEST(ReadPredictions, RefusesWhatIsNoDensityAtEachTime) {
  const tests::ScratchFolder folder;
  for (const std::string& wrong :
       {with("/modes/0/t/-", 0.8), with("/regions/0/level", json::array()), with("/modes/0/weight", -1),
        with("/modes/0/weight", 0), with("/modes/0/x/0", nullptr), with("/modes/0/cov/0", {0, 0, 0}),
        with("/modes/0/cov/1", {1, 2, 1}), with("/modes/0/cov/1", {-1, 0, -1}), with_changes({1.0, 2.0}, {0.5}),
        with_changes({1.0, 2.0}, {0.5, 1e300}), with_changes({2.0, 1.0}, {0.1, 0.2}), with_changes({}, {}),
        std::string("track_id,t,x,y"),
        std::string(R"({"track":"1","t0":1,"fallback":true,"novelty":0,"t":[],"modes":[]})")}) {
    const auto path = folder.write("lines.ndjson", prediction_line("1", two_modes()) + "\n" + wrong + "\n");
    const std::string message = message_of<FormatError>([&] { read_predictions(path); });
    EXPECT_TRUE(says(message, "ndjson:2: ")) << wrong;
    EXPECT_FALSE(says(message, "json.exception"));
  }
}

TEST(PredictionLine, StatesOutcomesOnRequest) {
  Prediction prediction = two_modes();
  const LineFormat format{.digits = 17, .outcomes = true};
  EXPECT_FALSE(json::parse(prediction_line("1", prediction, nullptr, nullptr, format)).contains("outcomes"));
  prediction.start_m = {-0.25, 3.5};
  prediction.heading = {0.6, 0.8};
  prediction.standing = true;
  EXPECT_FALSE(json::parse(prediction_line("1", prediction)).contains("outcomes"));
  const std::string line = prediction_line("1", prediction, nullptr, nullptr, format);
  const json outcomes = json::parse(line).at("outcomes");
  EXPECT_EQ(outcomes.at("within_s").get<std::vector<double>>(), (std::vector<double>{prediction.times_s.back()}));
  const OutcomeProbabilities expected = outcome_probabilities(prediction, 1);
  for (std::size_t k = 0; k < kOutcomeCount; ++k) EXPECT_EQ(outcomes.at(kOutcomes[k]).at(0), expected[k]);
  const Prediction read = read_back(line);
  EXPECT_TRUE(read.standing);
  EXPECT_EQ(read.start_m, prediction.start_m);
  EXPECT_EQ(read.heading, prediction.heading);
}

}  // namespace
}  // namespace sila
