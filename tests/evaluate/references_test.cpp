#include <gtest/gtest.h>

#include <random>

#include "sila/evaluate/training_support.hpp"
#include "sila/train/episode.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

constexpr std::size_t kSteps = 25;

/// People whose velocity changes by `acceleration` while they turn by `turn_radps`.
std::vector<Window> windows_of_people(double acceleration, double turn_radps) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<Window> windows;
  for (int i = 0; i < 60; ++i) {
    Window window;
    window.observed.id = std::to_string(i);
    Vector2 position(10.0 * uniform(random), 10.0 * uniform(random));
    double heading = 6.28 * uniform(random), speed = 0.8 + uniform(random);
    for (std::size_t k = 0; k < 16 + kSteps; ++k) {
      (k < 16 ? window.past_m : window.future_m).push_back(position);
      position += 0.2 * speed * Vector2(std::cos(heading), std::sin(heading));
      heading += 0.2 * turn_radps;
      speed *= 1.0 + 0.2 * acceleration;
    }
    windows.push_back(std::move(window));
  }
  return windows;
}

std::vector<LinearReference> fitted(const std::vector<Window>& windows) {
  std::vector<const Window*> pointers;
  for (const Window& window : windows) pointers.push_back(&window);
  return fit_references(pointers, kSteps, 0.2);
}

double end_error_m(const LinearReference& reference, const Window& window) {
  return (reference.predict(window.past_m, 0.2).modes.front().path_m.back() - window.future_m.back()).norm();
}

TEST(References, ConstantVelocityIsThatOfTheRawTrack) {
  const auto position_at = [](int k) { return Vector2(0.25 * k, k % 2 == 0 ? 0.3 : 0.0); };
  const Trajectory track = testing::sampled(60, 0.2, position_at);  // with jitter that smoothing would take away
  const Window window =
      windows_of(std::vector<FramedTrajectory>{{track, testing::square_frame()}}, {}, {}, 100.0).at(0);
  EXPECT_EQ(window.past_m.back(), track.positions_m[16]);
  EXPECT_LT((window.future_m[0] - track.positions_m[17]).norm(), 1e-9);
  const Prediction prediction = fit_references({}, kSteps, 0.2)[0].predict(window.past_m, 0.2);
  const Vector2 velocity = (track.positions_m[16] - track.positions_m[12]) / 0.8;
  EXPECT_LT((prediction.modes[0].path_m[24] - (track.positions_m[16] + 5.0 * velocity)).norm(), 1e-9);
}

TEST(References, LinearKnowsTurnsAndDampingKnowsSlowing) {
  const std::vector<Window> turning = windows_of_people(0.0, 0.2), slowing = windows_of_people(-0.15, 0.0);
  const auto of_turning = fitted(turning), of_slowing = fitted(slowing);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_LT(end_error_m(of_turning[3], turning[i]), 0.05 * end_error_m(of_turning[0], turning[i]));
    EXPECT_LT(end_error_m(of_slowing[2], slowing[i]), 0.1 * end_error_m(of_slowing[0], slowing[i]));
  }
  EXPECT_EQ(of_turning[1].predict(turning[0].past_m, 0.2).modes[0].path_m[7], turning[0].past_m.back());
}

TEST(References, AreWhatTheyAreWithoutWindows) {
  for (const LinearReference& reference : fit_references({}, kSteps, 0.2)) {
    const Prediction prediction = reference.predict(std::vector<Vector2>(16, Vector2(1, 2)), 0.2);
    EXPECT_LT((prediction.modes[0].path_m.back() - Vector2(1, 2)).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace sila
