// Models that would harm whoever uses them: their numbers agree with their checksum, but not with one another.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>

#include "io/made_up_model.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

struct Harm {
  const char* what;
  std::function<void(Model&)> doing;
};

ErrorStatistics& first(Model& model) {
  return model.refinement.error_statistics[0];
}

void expect_rejected(const std::vector<Harm>& harms) {
  ASSERT_NO_THROW(check(random_model(3)));
  for (const Harm& harm : harms) {
    Model model = random_model(3);
    harm.doing(model);
    EXPECT_THROW(check(model), std::invalid_argument) << harm.what;
  }
}

TEST(CheckModel, RejectsInvalidSettings) {
  expect_rejected({
      {"no interval", [](Model& m) { m.settings.sample_interval_s = 0.0; }},
      {"an interval that makes 10^300 steps", [](Model& m) { m.settings.sample_interval_s = 1e-300; }},
      {"an interval that is no number", [](Model& m) { m.settings.sample_interval_s = kNan; }},
      {"no width", [](Model& m) { m.settings.reference_width_m = 0.0; }},
      {"an infinite width", [](Model& m) { m.settings.reference_width_m = kInf; }},
      {"a horizon in the past", [](Model& m) { m.refinement.residual_settings.horizon_s = -1.0; }},
      {"a horizon that is no number", [](Model& m) { m.refinement.residual_settings.horizon_s = kNan; }},
      {"knots without a horizon", [](Model& m) { m.refinement.residual_settings.horizon_s = 0.0; }},
      {"tiles of which a cell number overflows", [](Model& m) { m.settings.grid.tile_cells = 2147483647; }},
      {"a cell without a side", [](Model& m) { m.settings.grid.cell = 1e-320; }},
      {"an origin beyond all places", [](Model& m) { m.settings.grid.origin.x() = 1e300; }},
  });
}

TEST(CheckModel, RejectsErrorStatisticsOfAnotherShape) {
  expect_rejected({
      {"more steps than rows", [](Model& m) { first(m).steps = 1000; }},
      {"steps whose product overflows", [](Model& m) { first(m).steps = 2000000000; }},
      {"negative steps", [](Model& m) { first(m).steps = -1; }},
      {"fewer features of a change", [](Model& m) { first(m).changes[kStanding].features.resize(2, 2); }},
      {"no interval", [](Model& m) { first(m).interval_s = 0.0; }},
      {"a regression less", [](Model& m) { first(m).stacking.pop_back(); }},
      {"a component less", [](Model& m) { first(m).density_place_free[kStanding].components.pop_back(); }},
      {"fewer features", [](Model& m) { first(m).density[kWalking].scale.features.resize(2, 2); }},
      {"features that are not square", [](Model& m) { first(m).stacking[0].features.conservativeResize(9, 8); }},
      {"fewer products", [](Model& m) { first(m).stacking[0].products.resize(3, 1); }},
      {"a product that is no number", [](Model& m) { first(m).stacking[0].products(2) = kNan; }},
      {"a negative weight", [](Model& m) { first(m).stacking[0].weight = -5.0; }},
      {"a negative residual", [](Model& m) { first(m).density[kWalking].components[0].along = -1.0; }},
      {"fewer bins", [](Model& m) { first(m).scores[2].pop_back(); }},
      {"a bin that is no number", [](Model& m) { first(m).scores[2][0] = kNan; }},
      {"a negative bin", [](Model& m) { first(m).novelties[0] = -1.0; }},
      {"an error that is no sum", [](Model& m) { first(m).slow[0].errors_m[2] = -1.0; }},
      {"fewer slow classes", [](Model& m) { first(m).slow.pop_back(); }},
      {"fewer novelties", [](Model& m) { first(m).novelties.pop_back(); }},
      {"rows without steps", [](Model& m) { first(m).steps = 0; }},
  });
}

TEST(CheckModel, TakesSumsOfSquaresThatRoundingLeftBelowZero) {
  Model model = random_model(3);
  model.refinement.error_statistics[0].density[kWalking].components[0].across = -1e-15;
  EXPECT_NO_THROW(check(model));
}

TEST(CheckModel, RejectsWhatIsBeyondTheGrid) {
  expect_rejected({
      {"an infinite weight", [](Model& m) { m.primitives[0].weight = kInf; }},
      {"a cell whose tile overflows", [](Model& m) { m.primitives[0].cells[0].cell.x = -2147483648; }},
      {"a field beyond all places", [](Model& m) { m.transitions[0].field.gp.pseudo_inputs(0, 0) = 1e300; }},
      {"a field as wide as the world", [](Model& m) { m.transitions[0].field.gp.kernel.length_scales(0) = 1e300; }},
      {"an extent that is no number", [](Model& m) { m.transitions[0].field.extent.min().x() = kNan; }},
      {"fewer episodes than none", [](Model& m) { m.episodes = -1; }},
      {"axes of a site that are no numbers", [](Model& m) { m.sites[0].frame.axis_1.x() = kNan; }},
      {"axes of a site that are infinite", [](Model& m) { m.sites[0].frame.axis_1.x() = kInf; }},
  });
}

TEST(CheckModel, RejectsCountsBySiteThatDoNotAddUp) {
  expect_rejected({
      {"a site that does not exist", [](Model& m) { m.transitions[1].sites[1].site = 2; }},
      {"a site twice", [](Model& m) { m.transitions[1].sites[1].site = 0; }},
      {"sites out of order", [](Model& m) { std::swap(m.transitions[1].sites[0], m.transitions[1].sites[1]); }},
      {"a part less", [](Model& m) { m.transitions[1].sites.pop_back(); }},
      {"no part", [](Model& m) { m.transitions[1].sites.clear(); }},
      {"a part of nothing", [](Model& m) { m.transitions[1].sites[0].count = 0.0; }},
      {"a part that is no number", [](Model& m) { m.transitions[1].sites[0].count = kNan; }},
      {"a count more", [](Model& m) { m.transitions[1].count += 1.0; }},
      {"seen in an episode to come", [](Model& m) { m.transitions[1].sites[0].last_episode = 4; }},
      {"several sites that are apart", [](Model& m) { m.sharing = SiteSharing::apart; }},
      {"a site with fewer episodes than none", [](Model& m) { m.sites[1].episodes = -1; }},
      {"a site with fewer tracks than none", [](Model& m) { m.sites[1].tracks = -1; }},
      {"a prior of another shape",
       [](Model& m) { m.refinement.prior = of_one_step(m.refinement.error_statistics[1]); }},
      {"error statistics of other steps",
       [](Model& m) { m.refinement.error_statistics[1] = of_one_step(m.refinement.error_statistics[1]); }},
  });
}

TEST(CheckModel, RejectsARefinementOfAnotherLength) {
  expect_rejected({
      {"a residual GP less", [](Model& m) { m.refinement.residuals.pop_back(); }},
      {"a residual GP more", [](Model& m) { m.refinement.residuals.emplace_back(); }},
      {"a transition less", [](Model& m) { m.transitions.pop_back(); }},
      {"error statistics less", [](Model& m) { m.refinement.error_statistics.pop_back(); }},
      {"a site more", [](Model& m) { m.sites.emplace_back(); }},
  });
  Model without = random_model(3);
  without.refinement = {};
  EXPECT_NO_THROW(check(without));
}

// Found by fuzzing: minus nothing was a size, and packed to other bits than it was unpacked from.
TEST(Packing, MinusZeroIsNoSize) {
  EXPECT_TRUE(unpack<std::vector<SiteCount>>(std::vector{0.0}).empty());
  EXPECT_THROW(unpack<std::vector<SiteCount>>(std::vector{-0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace sila
