#include "refine/fourier_features.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace sila {
namespace {

TEST(FourierBasis, ProductsOfFeaturesAreTheSumOfBothKernels) {
  constexpr int kFeatures = 8192, kWide = kFeatures / 4;
  constexpr double kAmplitude = 2.0;
  using Basis = FourierBasis<kFeatures, 2>;
  const auto basis = std::make_unique<const Basis>(kWide, kAmplitude);
  const auto features = [&](const Vector2& x) -> Eigen::ArrayXd {
    return basis->amplitudes.array() * (basis->frequencies * x + basis->phases).array().cos();
  };
  const Vector2 x(0.3, -1.0);
  for (const double distance : {0.0, 0.5, 1.0, 3.0, 6.0, 12.0}) {
    const Vector2 y = x + distance * Vector2(0.6, 0.8);
    const double square = distance * distance, wide = Basis::kWideScale * Basis::kWideScale;
    const double kernel =
        0.75 * std::exp(-square / 2.0) + 0.25 * kAmplitude * kAmplitude * std::exp(-square / (2.0 * wide));
    EXPECT_NEAR((features(x) * features(y)).sum(), kernel, 0.06) << distance;
  }
}

}  // namespace
}  // namespace sila
