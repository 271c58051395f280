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

void expect_refused(const std::vector<Harm>& harms) {
  ASSERT_NO_THROW(check(random_model(3)));
  for (const Harm& harm : harms) {
    Model model = random_model(3);
    harm.doing(model);
    EXPECT_THROW(check(model), std::invalid_argument) << harm.what;
  }
}

TEST(CheckModel, RefusesConventionsThatNobodyCanWalkBy) {
  expect_refused({
      {"no interval", [](Model& m) { m.conventions.sample_interval_s = 0.0; }},
      {"an interval that makes 10^300 steps", [](Model& m) { m.conventions.sample_interval_s = 1e-300; }},
      {"an interval that is no number", [](Model& m) { m.conventions.sample_interval_s = kNan; }},
      {"no width", [](Model& m) { m.conventions.reference_width_m = 0.0; }},
      {"an infinite width", [](Model& m) { m.conventions.reference_width_m = kInf; }},
      {"a horizon in the past", [](Model& m) { m.conventions.outlook_horizon_s = -1.0; }},
      {"a horizon that is no number", [](Model& m) { m.conventions.outlook_horizon_s = kNan; }},
      {"knots without a horizon", [](Model& m) { m.conventions.outlook_horizon_s = 0.0; }},
      {"tiles of which a cell number overflows", [](Model& m) { m.conventions.grid.tile_cells = 2147483647; }},
      {"a cell without a side", [](Model& m) { m.conventions.grid.cell = 1e-320; }},
      {"an origin beyond all places", [](Model& m) { m.conventions.grid.origin.x() = 1e300; }},
  });
}

TEST(CheckModel, RefusesLessonsOfAnotherShape) {
  expect_refused({
      {"more steps than rows", [](Model& m) { m.lessons.steps = 1000; }},
      {"steps whose product overflows", [](Model& m) { m.lessons.steps = 2000000000; }},
      {"other speed classes", [](Model& m) { m.lessons.classes = 1; }},
      {"no speed classes", [](Model& m) { m.lessons.classes = 0; }},
      {"no interval", [](Model& m) { m.lessons.interval_s = 0.0; }},
      {"a regression less", [](Model& m) { m.lessons.with_map.pop_back(); }},
      {"a residual less", [](Model& m) { m.lessons.residuals_place_free.pop_back(); }},
      {"fewer features", [](Model& m) { m.lessons.without_map[1].features.resize(2, 2); }},
      {"features that are not square", [](Model& m) { m.lessons.with_map[0].features.conservativeResize(9, 8); }},
      {"fewer products", [](Model& m) { m.lessons.with_map[0].products.resize(3); }},
      {"a product that is no number", [](Model& m) { m.lessons.with_map[0].products(2) = kNan; }},
      {"a negative weight", [](Model& m) { m.lessons.with_map[0].weight = -5.0; }},
      {"a negative residual", [](Model& m) { m.lessons.residuals_with_map[0].along_m2 = -1.0; }},
      {"fewer bins", [](Model& m) { m.lessons.surprises[2].pop_back(); }},
      {"a bin that is no number", [](Model& m) { m.lessons.surprises[2][0] = kNan; }},
      {"a negative bin", [](Model& m) { m.lessons.novelties[0] = -1.0; }},
      {"fewer novelties", [](Model& m) { m.lessons.novelties.pop_back(); }},
      {"rows without steps", [](Model& m) { m.lessons.steps = 0; }},
  });
}

TEST(CheckModel, TakesSumsOfSquaresThatRoundingLeftBelowZero) {
  Model model = random_model(3);
  model.lessons.residuals_with_map[0].across_m2 = -1e-15;
  EXPECT_NO_THROW(check(model));
}

TEST(CheckModel, RefusesWhatIsBeyondTheGrid) {
  expect_refused({
      {"an infinite weight", [](Model& m) { m.primitives[0].weight = kInf; }},
      {"a cell whose tile overflows", [](Model& m) { m.primitives[0].cells[0].cell.x = -2147483648; }},
      {"a field beyond all places", [](Model& m) { m.transitions[0].field.gp.pseudo_inputs(0, 0) = 1e300; }},
      {"a field as wide as the world", [](Model& m) { m.transitions[0].field.gp.kernel.length_scales(0) = 1e300; }},
      {"an extent that is no number", [](Model& m) { m.transitions[0].field.extent.min().x() = kNan; }},
      {"fewer episodes than none", [](Model& m) { m.episodes = -1; }},
      {"axes of a place that are no numbers", [](Model& m) { m.places[0].axis_1.x() = kNan; }},
      {"axes of a place that are infinite", [](Model& m) { m.places[0].axis_1.x() = kInf; }},
  });
}

// Found by fuzzing: minus nothing was a size, and packed to other bits than it was unpacked from.
TEST(Packing, MinusZeroIsNoSize) {
  EXPECT_TRUE(unpack_places(std::vector{0.0}).empty());
  EXPECT_THROW(unpack_places(std::vector{-0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace sila
