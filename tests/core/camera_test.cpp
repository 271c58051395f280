#include "sila/core/camera.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/message_of.hpp"
#include "support/walks.hpp"

namespace sila {
namespace {

/// A camera 6 m above the ground that looks down at 30 degrees; v points down in the picture.
Camera oblique() {
  Eigen::Matrix3d image_from_ground;
  image_from_ground << 1000.0, 480.0, 3000.0, 0.0, 200.0, 7600.0, 0.0, 0.75, 6.0;
  return camera_of(image_from_ground.inverse());
}

std::vector<PointPair> pairs_of(const Camera& camera, const std::vector<Vector2>& ground_m) {
  std::vector<PointPair> pairs;
  for (const Vector2& point : ground_m) pairs.push_back({to_image(camera, point).value(), point});
  return pairs;
}

std::string rejection(const std::vector<PointPair>& pairs) {
  return message_of([&] { fit_camera(pairs); });
}

TEST(Camera, FitsExactPairsExactlyAndGoesBothWays) {
  const Camera truth = oblique();
  const CameraFit fit = fit_camera(pairs_of(truth, {{0, 0}, {8, 1}, {-3, 20}, {6, 25}}));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x(-5, 10), y(0, 30);
  for (int i = 0; i < 200; ++i) {
    const Vector2 ground_m(x(random), y(random));
    const Vector2 image_px = to_image(truth, ground_m).value();
    EXPECT_NEAR((to_ground(fit.camera, image_px).value() - ground_m).norm(), 0.0, 1e-7);
    EXPECT_NEAR((to_image(fit.camera, ground_m).value() - image_px).norm(), 0.0, 1e-5);
  }
  for (const double residual_m : fit.residuals_m) EXPECT_LT(residual_m, 1e-8);
}

TEST(Camera, IsAsExactInCoordinatesOfAMap) {
  const Vector2 corner_m(691600.0, 5334700.0);  // UTM
  const Camera here = oblique();
  std::vector<PointPair> pairs = pairs_of(here, {{0, 0}, {8, 1}, {-3, 20}, {6, 25}, {2, 9}});
  for (PointPair& pair : pairs) pair.ground_m += corner_m;
  const CameraFit fit = fit_camera(pairs);
  for (const double residual_m : fit.residuals_m) EXPECT_LT(residual_m, 1e-6);
  for (const Vector2& point_m : {Vector2(1, 3), Vector2(7, 18), Vector2(-2, 28)}) {
    EXPECT_LT((to_image(fit.camera, point_m + corner_m).value() - to_image(here, point_m).value()).norm(), 1e-4);
    EXPECT_LT((image_jacobian(fit.camera, point_m + corner_m) - image_jacobian(here, point_m)).norm(), 1e-4);
  }
}

TEST(Camera, ReportsTheResidualsOfManyPairsInMetres) {
  std::vector<PointPair> pairs = pairs_of(oblique(), {{0, 0}, {8, 1}, {-3, 20}, {6, 25}, {2, 10}, {5, 5}, {-2, 4}});
  pairs[4].ground_m += Vector2(2, 0);
  const CameraFit fit = fit_camera(pairs);
  ASSERT_EQ(fit.residuals_m.size(), 7U);
  EXPECT_GT(fit.residuals_m[4], 0.5);
  EXPECT_LT(fit.residuals_m[4], 2.0);
}

TEST(Camera, RejectsFewCollinearRepeatedAndContradictingPairs) {
  const Camera camera = oblique();
  EXPECT_TRUE(says(rejection(pairs_of(camera, {{0, 0}, {8, 1}, {-3, 20}})), "at least 4"));
  EXPECT_TRUE(says(rejection(pairs_of(camera, {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}})), "collinear"));
  EXPECT_TRUE(says(rejection(pairs_of(camera, {{0, 0}, {8, 1}, {8, 1}, {0, 0}, {3, 20}})), "collinear"));
  EXPECT_TRUE(says(rejection(pairs_of(camera, {{1, 1}, {1, 1}, {1, 1}, {1, 1}})), "repeat"));
  std::vector<PointPair> crossed = pairs_of(camera, {{0, 0}, {8, 1}, {-3, 20}, {6, 25}});
  std::swap(crossed[0].ground_m, crossed[1].ground_m);  // two sides cross: the horizon is between the points
  EXPECT_TRUE(says(rejection(crossed), "horizon"));
}

TEST(Camera, SeesNoGroundAboveTheHorizonAndNothingBehindIt) {
  const Camera camera = oblique();
  EXPECT_TRUE(to_ground(camera, {500, 400}));
  EXPECT_FALSE(to_ground(camera, {500, 100}));
  EXPECT_FALSE(to_image(camera, {0, -100}));
  EXPECT_THROW(image_jacobian(camera, {0, -100}), std::invalid_argument);
}

TEST(Camera, TakesTheSignOfAHomographyFromAPointThatIsSeen) {
  const Camera camera = oblique();
  for (const double factor : {1.0, -1.0, 1e-6}) {
    const Camera same = camera_of(factor * camera.ground_from_image, Vector2(500, 900));
    EXPECT_NEAR((to_ground(same, {500, 900}).value() - to_ground(camera, {500, 900}).value()).norm(), 0.0, 1e-9);
    EXPECT_TRUE(to_ground(camera_of(factor * camera.ground_from_image), {500, 900}));
  }
  EXPECT_THROW(camera_of(Eigen::Matrix3d::Zero()), std::invalid_argument);
  EXPECT_THROW(camera_of(Eigen::Vector3d(1, 1, 0).asDiagonal().toDenseMatrix()), std::invalid_argument);
}

TEST(Camera, JacobianEqualsTheCentralDifference) {
  const Camera camera = oblique();
  const Vector2 at(2, 10);
  const Matrix2 jacobian = image_jacobian(camera, at);
  for (int j = 0; j < 2; ++j) {
    const Vector2 step = 1e-5 * Vector2::Unit(j);
    const Vector2 difference = (to_image(camera, at + step).value() - to_image(camera, at - step).value()) / 2e-5;
    EXPECT_NEAR((jacobian.col(j) - difference).norm(), 0.0, 1e-4);
  }
}

/// Ten who walk at a speed [units per second] and ten who stand in noise, for `seconds`.
std::vector<Trajectory> crowd(double speed, double noise, int seconds) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<Trajectory> tracks;
  for (int id = 0; id < 20; ++id) {
    const auto position_at = [&](int i) {
      return Vector2((id % 2 == 0 ? 0.1 * speed * i : 0.0) + noise * normal(random), noise * normal(random));
    };
    tracks.push_back(testing::sampled(10 * seconds + 1, 0.1, position_at, std::to_string(id)));
  }
  return tracks;
}

TEST(WalkingScale, IsThatOfThoseWhoWalkWhateverTheUnit) {
  for (const double unit : {1e-3, 1e-2, 1.0}) {
    const WalkingScale scale = walking_scale(crowd(60.0 * unit, 1.5 * unit, 8));
    EXPECT_EQ(scale.walking, 10U);
    EXPECT_NEAR(scale.metres_per_pixel, kTrialMetresPerPixel * 1.3 / (60.0 * unit), 0.02 * scale.metres_per_pixel);
  }
}

TEST(WalkingScale, LeavesPausesOut) {
  std::vector<Trajectory> tracks = crowd(60.0, 1.5, 8);
  for (Trajectory& track : tracks) {
    for (std::size_t i = 40; i < track.times_s.size(); ++i) track.times_s[i] += 10.0;  // stands in between
    for (int i = 1; i < 100; ++i) {
      track.times_s.insert(track.times_s.begin() + 39 + i, 3.9 + 0.1 * i);
      track.positions_m.insert(track.positions_m.begin() + 39 + i, Vector2(track.positions_m[39]));
    }
  }
  const double expected = kTrialMetresPerPixel * 1.3 / 60.0;
  EXPECT_NEAR(walking_scale(tracks).metres_per_pixel, expected, 0.05 * expected);
}

TEST(WalkingScale, NeedsFiveWhoWalkForThreeSeconds) {
  const auto message = [](const std::vector<Trajectory>& tracks) { return message_of([&] { walking_scale(tracks); }); };
  EXPECT_TRUE(says(message(crowd(0.0, 1.0, 8)), "0 of the first 20 tracks walk"));
  EXPECT_TRUE(says(message(crowd(60.0, 1.0, 2)), "camera or metres_per_unit"));
  EXPECT_TRUE(says(message(crowd(1.3 * kTrialMetresPerPixel, 0.0, 8)), "are the positions metres"));
  EXPECT_TRUE(says(message({}), "units = pixels"));
}

TEST(WalkingScale, MakesACameraWithYUpwards) {
  const Camera camera = flat_camera(0.02);
  EXPECT_TRUE(to_ground(camera, Vector2(100.0, 50.0)).value().isApprox(Vector2(2.0, -1.0)));
  EXPECT_TRUE(to_image(camera, Vector2(2.0, -1.0)).value().isApprox(Vector2(100.0, 50.0)));
}

}  // namespace
}  // namespace sila
