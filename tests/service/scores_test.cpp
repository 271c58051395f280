#include "sila/service/scores.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>
#include <sstream>

#include "sila/service/server.hpp"

namespace sila {
namespace {

PedestrianScore moving_pedestrian(double error_m) {
  PedestrianScore pedestrian;
  WindowScore window;
  window.moving = true;
  Metrics model, constant;
  model.weighted_mhd_m = error_m;
  constant.weighted_mhd_m = 1.0;
  window.model = {model};
  window.constant = {constant};
  add(pedestrian, window, false);
  return pedestrian;
}

Drift after(double before_m, double recent_m, unsigned seed) {
  ServiceConfig config;
  std::mt19937 random(seed);
  std::lognormal_distribution<double> spread(0.0, 0.5);
  RecentScores scores;
  for (int i = 0; i < 400; ++i) add(scores, moving_pedestrian(before_m * spread(random)), config);
  for (int i = 0; i < config.drift_pedestrians; ++i) add(scores, moving_pedestrian(recent_m * spread(random)), config);
  return drift_of(scores);
}

TEST(Drift, GivesNoAlarmWhileErrorsStayTheSame) {
  int alarms = 0;
  for (unsigned seed = 1; seed <= 500; ++seed) {
    const Drift drift = after(0.8, 0.8, seed);
    EXPECT_TRUE(drift.known);
    alarms += drift.alarm ? 1 : 0;
  }
  EXPECT_LE(alarms, 1);
}

TEST(Drift, GivesAnAlarmWhenErrorsGrowByHalf) {
  int alarms = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) alarms += after(0.8, 1.2, seed).alarm ? 1 : 0;
  EXPECT_GE(alarms, 90);
}

TEST(Drift, IsUnknownForAFewPedestrians) {
  ServiceConfig config;
  RecentScores scores;
  for (int i = 0; i < 3 * config.drift_pedestrians - 1; ++i) {
    EXPECT_FALSE(drift_of(scores).known);
    add(scores, moving_pedestrian(i < 100 ? 1.0 : 100.0), config);
  }
}

TEST(RecentScores, KeepsTheLastPedestrians) {
  const ServiceConfig config{.scored_pedestrians = 20};
  RecentScores scores;
  for (int i = 0; i < 100; ++i) add(scores, moving_pedestrian(i), config);
  add(scores, PedestrianScore{}, config);
  ASSERT_EQ(scores.size(), 20u);
  EXPECT_EQ(totals(scores, true).front().windows, 20u);
  EXPECT_DOUBLE_EQ(totals(scores, true).front().weighted_mhd_m, 20 * (80 + 99) / 2.0);
  EXPECT_LT(coverage(scores).front().front(), 0.0);
}

/// The scale of the nonconformity scores changes twice; the regions assume exponential scores with mean 1.
TEST(OnlineCalibration, CoverageConvergesToNominal) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    ServiceConfig config;
    std::mt19937 random(seed);
    std::exponential_distribution<double> nonconformity(1.0);
    OnlineCalibration online_calibration;
    RecentScores scores;
    for (int i = 0; i < 1000; ++i) {
      const double scale = i < 300 ? 0.5 : (i < 700 ? 3.0 : 1.5);
      Prediction prediction;
      prediction.times_s = {1.0};
      for (const double p : kRegionProbabilities) prediction.regions.push_back({p, {-std::log1p(-p)}});
      prediction = calibrated(prediction, online_calibration);
      PedestrianScore pedestrian;
      for (int k = 0; k < 4; ++k) {
        const double found = scale * nonconformity(random);
        WindowScore window;
        window.model.resize(1);
        window.constant.resize(1);
        for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p)
          window.model[0].coverage[p] = found <= prediction.regions[p].levels[0] ? 1.0 : 0.0;
        add(pedestrian, window, true);
      }
      online_calibration = fitted(std::move(online_calibration), pedestrian, {1.0}, config.calibration_step);
      add(scores, std::move(pedestrian), config);
    }
    for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p) {
      const double share = coverage(scores).front()[p];
      EXPECT_NEAR(share, kRegionProbabilities[p], 0.03) << "seed " << seed;
      // The error of the coverage is exactly the movement of the factor.
      EXPECT_NEAR(1000.0 * config.calibration_step * (kRegionProbabilities[p] - share),
                  online_calibration.log_factors[0][p], 1e-6);
    }
  }
}

TEST(OnlineCalibration, RegionsGrowWithTheProbability) {
  OnlineCalibration online_calibration{{1.0, 2.0}, {{2.0, -3.0, 0.0, -1.0}, {0.0, 0.0, -2.0, 1.0}}};
  Prediction prediction;
  prediction.times_s = {0.5, 1.0, 1.5, 2.0, 5.0};
  for (const double p : kRegionProbabilities)
    prediction.regions.push_back({p, std::vector<double>(5, -std::log1p(-p))});
  prediction = calibrated(prediction, online_calibration);
  for (std::size_t p = 1; p < prediction.regions.size(); ++p) {
    for (std::size_t j = 0; j < 5; ++j) EXPECT_GE(prediction.regions[p].levels[j], prediction.regions[p - 1].levels[j]);
  }
  EXPECT_NEAR(prediction.regions[0].levels[2], -std::log1p(-0.25) * std::exp(1.0), 1e-12);
}

TEST(OnlineCalibration, IsReadWholeOrNotAtAll) {
  const auto read = [](std::string statistics) {
    StoredModel stored;
    stored.episodes.emplace_back().statistics = std::move(statistics);
    return calibration_in(stored).horizons_s.size();
  };
  const auto horizons_in = [&](const std::string& horizons, const std::string& rows) {
    return read(R"({"online_calibration": {"horizons_s": )" + horizons + R"(, "log_factors": )" + rows + "}}");
  };
  EXPECT_EQ(horizons_in("[1, 2]", "[[0, 0, 0, 0], [0.5, 0, 0, 0]]"), 2U);
  for (const char* rows : {"[[0, 0, 0]]", "[[0, 0, 0, 0, 0]]", "[[0, 0, 0, null]]", "[[0, 0, 0, true]]", "[[]]",
                           "[[0, 0, 0, 0], [0, 0, 0, 0]]", "{}", "null"})
    EXPECT_EQ(horizons_in("[1]", rows), 0U) << rows;
  for (const char* horizons : {"[null]", "[\"1\"]", "1", "{}"})
    EXPECT_EQ(horizons_in(horizons, "[[0, 0, 0, 0]]"), 0U) << horizons;
  for (const char* statistics : {"", "[]", "{}", R"({"online_calibration": 1})"})
    EXPECT_EQ(read(statistics), 0U) << statistics;
  EXPECT_TRUE(calibration_in(StoredModel{}).horizons_s.empty());
}

TEST(ServiceMetrics, AreInTheTableOfThePage) {
  std::ifstream file(SILA_TESTS_DIR "/../docs/service.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  ServiceMetrics metrics;
  metrics.drift.known = true;
  std::istringstream text(metrics_text(metrics));
  int families = 0;
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with("# HELP ")) continue;
    const std::string name = line.substr(7, line.find(' ', 7) - 7);
    const auto has = [&](const char* end) { return page.find('`' + name + end) != std::string::npos; };
    EXPECT_TRUE(has("`") || has("{")) << name;
    ++families;
  }
  EXPECT_GT(families, 40);
}

}  // namespace
}  // namespace sila
