#include <gtest/gtest.h>

#include <cmath>

#include "sila/evaluate/training_support.hpp"

namespace sila {
namespace {

/// A window that comes along the x axis at 1.2 m/s to the origin and goes on to `end_m`.
Window window_to(const Vector2& end_m) {
  Window window;
  for (int k = 15; k >= 0; --k) window.past_m.emplace_back(-0.24 * k, 0.0);
  window.future_m = {end_m};
  return window;
}

/// People who come along in the same way and go on in these directions [degrees], or stay.
std::vector<Passage> passages(const std::vector<double>& directions_deg, int staying = 0) {
  std::vector<Passage> result;
  for (std::size_t i = 0; i < directions_deg.size() + static_cast<std::size_t>(staying); ++i) {
    const bool stays = i >= directions_deg.size();
    const double direction = stays ? 0.0 : directions_deg[i] * M_PI / 180.0;
    result.push_back({std::to_string(i),
                      {0.1, 0.1},
                      {1.2, 0.0},
                      5.0 * (stays ? 0.02 : 1.0) * Vector2(std::cos(direction), std::sin(direction))});
  }
  return result;
}

std::vector<double> around(double degrees, int people) {
  std::vector<double> directions;
  for (int i = 0; i < people; ++i) directions.push_back(degrees + 0.5 * (i % 9 - 4));
  return directions;
}

std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Prediction to(const std::vector<std::pair<double, Vector2>>& weights_and_ends) {
  Prediction prediction;
  for (const auto& [weight, end] : weights_and_ends)
    prediction.modes.push_back({weight, {end}, {0.04 * Matrix2::Identity()}, {}});
  return prediction;
}

TEST(Forks, AreWhereTwoWaysWereTakenByEnoughPeople) {
  const Window window = window_to({5, 0});
  EXPECT_EQ(ways_on(passages(joined(around(0, 15), around(90, 10))), window, 0.2).size(), 2u);
  EXPECT_EQ(ways_on(passages(joined(around(0, 25), around(90, 3))), window, 0.2).size(), 1u);
  EXPECT_EQ(ways_on(passages(joined(around(0, 5), around(90, 5))), window, 0.2).size(), 0u);  // too few people
  EXPECT_EQ(ways_on(passages(around(0, 15), 10), window, 0.2).size(), 2u);                    // one is to stay
  EXPECT_EQ(ways_on(passages(joined(around(178, 10), around(-179, 10))), window, 0.2).size(), 1u);
  std::vector<double> spread;
  for (int i = 0; i < 20; ++i) spread.push_back(9.0 * i);
  EXPECT_EQ(ways_on(passages(spread), window, 0.2).size(), 1u);  // an open square is no fork
}

TEST(Forks, PeopleWhoCameOtherwiseDoNotCount) {
  std::vector<Passage> others = passages(joined(around(0, 15), around(90, 15)));
  for (Passage& passage : others) passage.velocity_mps = {-1.2, 0.0};
  EXPECT_TRUE(ways_on(others, window_to({5, 0}), 0.2).empty());
}

TEST(Forks, TheProbabilityIsThatOfTheWayTaken) {
  const Window straight = window_to({5, 0}), left = window_to({0, 5});
  const std::vector<Way> ways = ways_on(passages(joined(around(0, 15), around(90, 10))), straight, 0.2);
  const Prediction both = to({{0.7, {5, 0}}, {0.3, {0, 5}}});
  EXPECT_NEAR(*probability_of_way_taken(both, straight, ways), 0.7, 1e-9);
  EXPECT_NEAR(*probability_of_way_taken(both, left, ways), 0.3, 1e-9);
  EXPECT_NEAR(*probability_of_way_taken(to({{1.0, {5, 0}}}), left, ways), 1e-4, 1e-12);  // never minus infinity
  EXPECT_NEAR(*probability_of_way_taken(to({{1.0, {3, 3}}}), left, ways), 0.5, 0.05);
  EXPECT_FALSE(probability_of_way_taken(both, straight, std::span(ways).first(1)));
}

}  // namespace
}  // namespace sila
