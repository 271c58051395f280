#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <vector>

#include "example.hpp"
#include "gp/fit.hpp"
#include "gp/fuse_gps.hpp"
#include "gp/posterior.hpp"

namespace sila::gp_tests {
namespace {

GpData nothing(Eigen::Index inputs = 2, Eigen::Index outputs = 2) {
  return {Eigen::MatrixXd(inputs, 0), Eigen::MatrixXd(0, outputs)};
}

SparseGp fuse(std::vector<const SparseGp*> parts, const GpData& data, const GpConfig& config = {}) {
  return fuse_gps(parts, data, config);
}

void expect_same_predictions(const SparseGp& a, const SparseGp& b, double tolerance, Generator& make) {
  const Posterior first(a);
  const Posterior second(b);
  for (int i = 0; i < 50; ++i) {
    const Eigen::VectorXd x = make.points(a.pseudo_inputs.rows(), 1, 8.0);
    EXPECT_NEAR((predict(first, x).mean - predict(second, x).mean).norm(), 0.0, tolerance);
    EXPECT_NEAR(predict(first, x).variance, predict(second, x).variance, tolerance);
  }
}

/// Root mean square difference of the mean to what the data were made of, and mean negative log density of new
/// observations.
struct Score {
  double error = 0.0;
  double nll = 0.0;
};

Score score(const SparseGp& gp, const GpData& truth) {
  const Posterior posterior(gp);
  Score sum;
  const double count = static_cast<double>(truth.outputs.size());
  for (Eigen::Index n = 0; n < truth.inputs.cols(); ++n) {
    const GpPrediction prediction = predict(posterior, truth.inputs.col(n));
    const double squared = (prediction.mean - truth.outputs.row(n).transpose()).squaredNorm();
    const double variance = prediction.variance + gp.noise_variance;
    sum.error += squared / count;
    sum.nll += 0.5 * (squared / variance / 2.0 + std::log(2.0 * std::numbers::pi * variance)) * 2.0 / count;
  }
  sum.error = std::sqrt(sum.error);
  return sum;
}

/// The formulas of docs/gp.md, section 7, with an eigen-decomposition and no special cases.
SparseGp textbook_transfer(const SparseGp& a, const SparseGp& into) {
  const auto lower_of = [](const SparseGp& gp) -> Eigen::MatrixXd {
    Eigen::MatrixXd own = covariance(gp.kernel, gp.pseudo_inputs, gp.pseudo_inputs);
    own.diagonal().array() += gp.jitter * gp.kernel.signal_variance;
    return own.llt().matrixL();
  };
  const Eigen::MatrixXd la = lower_of(a);
  const Eigen::MatrixXd lb = lower_of(into);
  const Eigen::MatrixXd w =
      lb.triangularView<Eigen::Lower>().solve(covariance(into.kernel, into.pseudo_inputs, a.pseudo_inputs));
  const Eigen::MatrixXd u = la.triangularView<Eigen::Lower>().solve(w.transpose()).transpose();
  const Eigen::MatrixXd inner = covariance(into.kernel, a.pseudo_inputs, a.pseudo_inputs) - w.transpose() * w;
  const Eigen::MatrixXd half = la.triangularView<Eigen::Lower>().solve(inner);
  const Eigen::MatrixXd e = la.triangularView<Eigen::Lower>().solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(a.information);
  const Eigen::MatrixXd f = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd q = Eigen::MatrixXd::Identity(f.cols(), f.cols()) + f.transpose() * e * f;
  const Eigen::MatrixXd damped = f * q.inverse() * f.transpose();
  const Eigen::MatrixXd response = a.response + a.mean_response * (a.mean - into.mean).transpose();
  SparseGp result = into;
  result.information += u * damped * u.transpose();
  result.response += u * (response - damped * e * response);
  result.mean_response += u * (a.mean_response - damped * e * a.mean_response);
  return result;
}

TEST(Transfer, ByCholeskyEqualsTheEigenDecomposition) {
  for_seeds(4 * seeds, [](Generator& make, unsigned seed) {
    const Hyperparameters old_theta = make.hyperparameters(2);
    const Hyperparameters new_theta = seed % 2 == 0 ? old_theta : make.hyperparameters(2);
    const Eigen::Index points = seed % 3 == 0 ? 5 : 80;  // with 5 points G has not full rank
    const SparseGp prior = prior_gp(old_theta.kernel, old_theta.noise_variance,
                                    select_pseudo_inputs(old_theta.kernel, make.points(2, 60), 12), vector({1, 0}));
    const SparseGp old = condition(prior, make.data(2, points, 2));
    const SparseGp into = prior_gp(new_theta.kernel, new_theta.noise_variance,
                                   select_pseudo_inputs(new_theta.kernel, make.points(2, 60), 9), vector({0.5, 1}));
    const SparseGp found = transfer(old, into);
    const SparseGp wanted = textbook_transfer(old, into);
    EXPECT_TRUE(found.information.isApprox(wanted.information, 1e-8));
    EXPECT_TRUE(found.response.isApprox(wanted.response, 1e-8));
    EXPECT_TRUE(found.mean_response.isApprox(wanted.mean_response, 1e-8));
    EXPECT_EQ(found.information, found.information.transpose().eval());
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(found.information);
    EXPECT_GE(eigen.eigenvalues().minCoeff(), -1e-10 * eigen.eigenvalues().maxCoeff());
  });
}

TEST(Transfer, ToTheSameBasisAddsExactly) {
  Generator make(1);
  const SparseGp gp = fit_sparse_gp(make.data(2, 60, 2), make.hyperparameters(2));
  const SparseGp into = prior_gp(gp.kernel, gp.noise_variance, gp.pseudo_inputs, gp.mean, gp.jitter);
  EXPECT_TRUE(transfer(gp, into) == gp);
}

/// Counts every data point `factor` times: the statistics are sums over points.
SparseGp repeated(SparseGp gp, double factor) {
  gp.information *= factor;
  gp.response *= factor;
  gp.mean_response *= factor;
  gp.points *= factor;
  return gp;
}

// What the new pseudo-inputs explain whole is then left with rounding, of either sign, times what was seen.
TEST(Transfer, OfVeryManyPointsIsValid) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const Hyperparameters theta = make.hyperparameters(2);
    const GpData data = make.data(2, 80, 2);
    const Eigen::MatrixXd pseudo_inputs = select_pseudo_inputs(theta.kernel, data.inputs, 30);
    const SparseGp seen = condition(prior_gp(theta.kernel, theta.noise_variance, pseudo_inputs, vector({0, 0})), data);
    Eigen::MatrixXd superset(2, pseudo_inputs.cols() + 2);
    superset << make.points(2, 2, 12.0), pseudo_inputs.rowwise().reverse();
    const SparseGp prior = prior_gp(theta.kernel, theta.noise_variance, superset, vector({0, 0}));
    for (double often = 1.0; often < 1e16; often *= 100.0) {
      SCOPED_TRACE("times " + std::to_string(often));
      const SparseGp moved = transfer(repeated(seen, often), prior);
      EXPECT_NO_THROW(validate(moved));
      if (often > 1e10) continue;
      const Posterior after(moved), before(repeated(seen, often));
      for (const auto& x : data.inputs.leftCols(5).colwise())
        EXPECT_LT((predict(after, x).mean - predict(before, x).mean).norm(), 1e-3);
    }
  });
}

TEST(Transfer, ToASupersetLosesNothingInSpiteOfTheJitter) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const SparseGp gp = fit_sparse_gp(make.data(2, 60, 2), make.hyperparameters(2));
    const Eigen::Index size = gp.pseudo_inputs.cols();
    Eigen::MatrixXd superset(2, size + 3);
    superset << make.points(2, 1, 12.0), gp.pseudo_inputs.rowwise().reverse(), make.points(2, 2, 12.0);
    const SparseGp wider = transfer(gp, prior_gp(gp.kernel, gp.noise_variance, superset, gp.mean));
    const SparseGp back = transfer(wider, prior_gp(gp.kernel, gp.noise_variance, gp.pseudo_inputs, gp.mean));
    expect_same_predictions(gp, wider, 1e-8, make);
    EXPECT_TRUE(back.information.isApprox(gp.information, 1e-8));
    EXPECT_TRUE(back.response.isApprox(gp.response, 1e-8));
  });
}

TEST(FuseSources, OfAnEmptyGpAndAnotherIsTheOther) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const GpData data = make.data(2, 60, 2);
    const SparseGp gp = fit_sparse_gp(data, make.hyperparameters(2));
    const SparseGp empty = fit_sparse_gp(nothing(), make.hyperparameters(2));
    for (const GpSource& source : {GpSource{&gp}, GpSource{&gp, &data}}) {
      EXPECT_TRUE(fuse_sources(std::array{source, GpSource{&empty}}, {}) == gp);
      EXPECT_TRUE(fuse_sources(std::array{GpSource{&empty}, source}, {}) == gp);
    }
  });
}

TEST(FuseGps, DoesNotDependOnTheOrderOfTheParts) {
  for (const GpFusion way : {GpFusion::transfer, GpFusion::pseudo_data}) {
    for_seeds(seeds, [&](Generator& make, unsigned seed) {
      const Hyperparameters theta = make.hyperparameters(2);
      std::vector<SparseGp> parts;
      for (int i = 0; i < 3; ++i) {
        parts.push_back(fit_sparse_gp(make.data(2, 30, 2), seed % 2 == 0 ? theta : make.hyperparameters(2)));
      }
      const GpData data = seed % 3 == 0 ? nothing() : make.data(2, 25, 2);
      const GpConfig config{.fusion = way};
      const SparseGp forward = fuse({&parts[0], &parts[1], &parts[2]}, data, config);
      const SparseGp backward = fuse({&parts[2], &parts[0], &parts[1]}, data, config);
      EXPECT_TRUE(forward.pseudo_inputs.isApprox(backward.pseudo_inputs, 1e-12));
      EXPECT_TRUE(forward.mean.isApprox(backward.mean, 1e-12));
      EXPECT_EQ(forward.points, backward.points);
      expect_same_predictions(forward, backward, 1e-8, make);
    });
  }
}

TEST(FuseGps, KeepsAThetaThatAllPartsShareBitForBit) {
  Generator make(6);
  const Hyperparameters theta{{0.1 + 0.2, vector({1.0 / 3.0, 0.7})}, 0.09};
  const SparseGp a = fit_sparse_gp(make.data(2, 30, 2), theta);
  const SparseGp b = fit_sparse_gp(make.data(2, 47, 2), theta);
  const SparseGp fused = fuse({&a, &b}, make.data(2, 11, 2));
  EXPECT_TRUE(fused.kernel == theta.kernel);
  EXPECT_EQ(fused.noise_variance, theta.noise_variance);
}

TEST(FuseGps, ThetaIsTheWeightedLogMeanAndMeanTheWeightedMean) {
  Generator make(6);
  const SparseGp a = fit_sparse_gp(make.data(2, 30, 2), {{1.0, vector({1.0, 2.0})}, 0.1});
  const SparseGp b = fit_sparse_gp(make.data(2, 10, 2), {{16.0, vector({1.0, 0.125})}, 0.1});
  const GpData data = make.data(2, 40, 2);
  const std::vector<const SparseGp*> parts{&a, &b};
  const SparseGp two = fuse_gps(parts, data);
  EXPECT_NEAR(two.kernel.signal_variance, 2.0, 1e-12);
  EXPECT_NEAR(two.kernel.length_scales(1), 1.0, 1e-12);
  EXPECT_EQ(two.kernel.length_scales(0), 1.0);
  const Eigen::VectorXd mean =
      (30.0 * a.mean + 10.0 * b.mean + Eigen::VectorXd(data.outputs.colwise().sum().transpose())) / 80.0;
  EXPECT_TRUE(two.mean.isApprox(mean, 1e-12));
  EXPECT_EQ(two.points, 80.0);
  const SparseGp three = fuse_gps(parts, data, {}, Hyperparameters{{8.0, vector({1.0, 1.0})}, 0.1});
  EXPECT_NEAR(three.kernel.signal_variance, 4.0, 1e-12);
}

TEST(FuseGps, WithDataOnOldGroundIsExactlyConditioning) {
  Generator make(8);
  const Hyperparameters theta{{1.0, vector({2.0, 2.0})}, 0.05};
  const SparseGp old = fit_sparse_gp(make.data(2, 300, 2), theta);
  const GpData data = make.data_at(make.points(2, 40, 4.0), 2);
  const SparseGp fused = fuse({&old}, data);
  EXPECT_EQ(fused.pseudo_inputs, old.pseudo_inputs);
  expect_same_predictions(
      fused,
      condition(transfer(old, prior_gp(theta.kernel, theta.noise_variance, old.pseudo_inputs, fused.mean)), data),
      1e-10, make);
}

TEST(FuseGps, NeedsAPart) {
  EXPECT_THROW(fuse_gps({}, Generator(9).data(2, 50, 2)), std::invalid_argument);
}

TEST(FuseGps, OfPartsWithOnePointIsTheirMean) {
  const Hyperparameters theta{{0.64, vector({2, 2})}, 0.09};
  const SparseGp a = fit_sparse_gp({Eigen::MatrixXd::Zero(2, 1), Eigen::MatrixXd::Constant(1, 2, 1.0)}, theta);
  const SparseGp b = fit_sparse_gp({Eigen::MatrixXd::Ones(2, 1), Eigen::MatrixXd::Constant(1, 2, 2.0)}, theta);
  const SparseGp fused = fuse({&a, &b}, nothing());
  EXPECT_EQ(fused.points, 2.0);
  EXPECT_EQ(Posterior(fused).predict_flow({0, 0}).mean, Eigen::Vector2d(1.5, 1.5));
}

TEST(FuseGps, AGpWithNearlyAllPointsKeepsItsPseudoInputs) {
  Generator make(3);
  const Hyperparameters theta{{0.8, vector({0.7, 0.7})}, 0.04};
  GpConfig config{.max_pseudo_inputs = 12, .max_fused_pseudo_inputs = 12};
  const SparseGp much = fit_sparse_gp(make.data_at(make.points(2, 95, 3.0), 2), theta, config);
  const SparseGp little = fit_sparse_gp(make.data_at(make.points(2, 5, 3.0), 2), theta, config);
  ASSERT_EQ(much.pseudo_inputs.cols(), 12);
  for (const auto& parts : {std::vector{&much, &little}, std::vector{&little, &much}}) {
    const SparseGp kept = fuse_gps(parts, nothing(), config);
    EXPECT_EQ(kept.pseudo_inputs, much.pseudo_inputs);
    EXPECT_TRUE(kept.information.isApprox(transfer(little, much).information, 1e-9));
  }
  config.keep_pseudo_inputs_share = 0.96;
  const SparseGp* const both[] = {&much, &little};
  EXPECT_NE(fuse_gps(both, nothing(), config).pseudo_inputs, much.pseudo_inputs);
}

TEST(FuseGps, EpisodeAfterEpisodeStaysCloseToOneFitOfAllData) {
  for_seeds(4, [](Generator& make, unsigned) {
    const Hyperparameters theta{{0.8, vector({1.5, 1.5})}, 0.04};
    const GpConfig config{.max_pseudo_inputs = 40, .max_fused_pseudo_inputs = 40};
    GpConfig suk = config;
    suk.fusion = GpFusion::pseudo_data;
    GpData all = nothing(), last;
    SparseGp episodes, pseudo_data;
    for (int episode = 0; episode < 15; ++episode) {  // a window that moves over the field
      Eigen::MatrixXd inputs = make.points(2, 30, 3.0);
      inputs.row(0).array() += -3.0 + 6.0 * episode / 14.0;
      last = make.data_at(inputs, 2);
      all = joined(all, last);
      episodes = episode == 0 ? fit_sparse_gp(last, theta, config) : fuse({&episodes}, last, config);
      pseudo_data = episode == 0 ? episodes : fuse({&pseudo_data}, last, suk);
    }
    Eigen::MatrixXd where = make.points(2, 300, 3.0);
    where.row(0) *= 3.0;
    const GpData truth = make.data_at(where, 2, 0.0);
    const Score batch = score(fit_sparse_gp(all, theta, config), truth);
    const Score fused = score(episodes, truth);
    const Score suks = score(pseudo_data, truth);
    const Score only_last = score(fit_sparse_gp(last, theta, config), truth);
    EXPECT_LT(fused.error, 1.1 * batch.error);
    EXPECT_LT(fused.nll, batch.nll + 0.03);
    EXPECT_LT(suks.error, 2.0 * batch.error);
    EXPECT_GT(only_last.error, 2.0 * batch.error);
    EXPECT_EQ(episodes.points, 450.0);
  });
}

}  // namespace
}  // namespace sila::gp_tests
