// The field's protocol on the files nearly every paper uses: every run of 20 consecutive samples of one person, 8 seen,
// 12 predicted, 0.4 s. If constant velocity did not come out as known here, no other figure of ours could be trusted.

#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "sila/evaluate/metrics.hpp"
#include "sila/io/track_files.hpp"
#include "support/data.hpp"

namespace sila {
namespace {

struct Scores {
  std::size_t windows = 0;
  double ade_m = 0.0, fde_m = 0.0;
};

using Samples = std::vector<std::pair<double, Vector2>>;

/// Adds every window of one file, predicted by `predict(eight seen, twelve true)`.
template <class Predict>
void add_windows(Scores& scores, const std::filesystem::path& file, const Predict& predict) {
  std::map<std::string, Samples> people;
  for (const Detection& row : read_detections(file).detections.rows)
    people[row.track].emplace_back(row.t_s, row.position_m);
  for (auto& [id, samples] : people) {
    for (std::size_t start = 0; start + 20 <= samples.size(); ++start) {
      if (samples[start + 19].first - samples[start].first > 19 * 0.4 + 0.01) continue;  // not consecutive
      std::vector<Vector2> seen, truth;
      for (std::size_t k = 0; k < 20; ++k) (k < 8 ? seen : truth).push_back(samples[start + k].second);
      Prediction prediction;
      prediction.modes.push_back({1.0, predict(seen, truth), std::vector<Matrix2>(12, Matrix2::Identity()), {}});
      const Metrics metrics = measure(prediction, truth, 12);
      ++scores.windows;
      scores.ade_m += metrics.ade_m;
      scores.fde_m += metrics.fde_m;
    }
  }
}

std::vector<Vector2> last_step_goes_on(const std::vector<Vector2>& seen, const std::vector<Vector2>&) {
  std::vector<Vector2> path;
  for (int k = 1; k <= 12; ++k) path.emplace_back(seen[7] + k * (seen[7] - seen[6]));
  return path;
}

struct Known {
  std::vector<const char*> files;
  std::size_t windows;
  double ade_m, fde_m;
};

TEST(FieldProtocol, ConstantVelocityScoresAsKnownAndAnOracleScoresZero) {
  const auto recordings = testing::recordings();
  if (!recordings) GTEST_SKIP() << "no recordings on this machine; set SILA_DATA_DIR";
  const std::filesystem::path folder = *recordings / "eth_ucy" / "sgan_format";
  const Known known[] = {{{"biwi_eth.txt"}, 364, 1.075, 2.282},
                         {{"biwi_hotel.txt"}, 1197, 0.319, 0.614},
                         {{"students001.txt", "students003.txt"}, 24334, 0.524, 1.165},
                         {{"crowds_zara01.txt"}, 2356, 0.427, 0.952},
                         {{"crowds_zara02.txt"}, 5910, 0.324, 0.724}};
  for (const Known& set : known) {
    SCOPED_TRACE(set.files.front());
    Scores scores, oracle;
    for (const char* file : set.files) {
      add_windows(scores, folder / file, last_step_goes_on);
      add_windows(oracle, folder / file, [](const auto&, const std::vector<Vector2>& truth) { return truth; });
    }
    EXPECT_EQ(scores.windows, set.windows);
    EXPECT_NEAR(scores.ade_m / static_cast<double>(scores.windows), set.ade_m, 0.0006);  // known to three decimals
    EXPECT_NEAR(scores.fde_m / static_cast<double>(scores.windows), set.fde_m, 0.0006);
    EXPECT_EQ(oracle.ade_m, 0.0);
    EXPECT_EQ(oracle.fde_m, 0.0);
  }
}

}  // namespace
}  // namespace sila
