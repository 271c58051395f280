#include "gp/fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "statistics.hpp"

namespace sila {
namespace {

/// Z of the data, chosen greedily, and the factor of k(Z, Z).
std::pair<Eigen::MatrixXd, Eigen::MatrixXd> choose_greedily(const GpData& data, const Kernel& kernel,
                                                            const GpConfig& config) {
  const Eigen::MatrixXd candidates = detail::candidates_for(kernel, data.inputs);
  detail::Selection selection =
      detail::select_greedily(kernel, candidates, config.max_pseudo_inputs, config.selection_stop, default_jitter);
  return {candidates(Eigen::all, selection.chosen), std::move(selection.lower)};
}

/// theta as the optimiser sees it: log length scales, log noise variance, log (signal variance / noise variance). In
/// these the floors of noise and of noise to signal are both a box.
Eigen::VectorXd to_vector(const Hyperparameters& theta) {
  const Eigen::Index dimensions = theta.kernel.length_scales.size();
  Eigen::VectorXd v(dimensions + 2);
  v.head(dimensions) = theta.kernel.length_scales.array().log();
  v(dimensions) = std::log(theta.noise_variance);
  v(dimensions + 1) = std::log(theta.kernel.signal_variance / theta.noise_variance);
  return v;
}

Hyperparameters to_hyperparameters(const Eigen::VectorXd& v) {
  const Eigen::Index dimensions = v.size() - 2;
  const double noise = std::exp(v(dimensions));
  return {{noise * std::exp(v(dimensions + 1)), v.head(dimensions).array().exp()}, noise};
}

Eigen::VectorXd gradient_of_vector(const MarginalLikelihoodGradient& gradient) {
  const Eigen::Index dimensions = gradient.log_length_scales.size();
  Eigen::VectorXd v(dimensions + 2);
  v.head(dimensions) = gradient.log_length_scales;
  v(dimensions) = gradient.log_noise_variance + gradient.log_signal_variance;
  v(dimensions + 1) = gradient.log_signal_variance;
  return v;
}

/// Bounds of theta for these data; the start, if outside, is clamped to them. The curvature of the log marginal
/// likelihood is about the number of points.
detail::SearchBox theta_box(const Hyperparameters& start, const GpData& centred, const GpConfig& config) {
  constexpr double max_noise_to_signal = 10.0;
  const Eigen::VectorXd extent = centred.inputs.rowwise().maxCoeff() - centred.inputs.rowwise().minCoeff();
  const double mean_square = centred.outputs.squaredNorm() / static_cast<double>(centred.outputs.size());
  const Eigen::Index dimensions = extent.size();
  const double typical_step = 1.0 / std::sqrt(static_cast<double>(centred.inputs.cols()));
  detail::SearchBox box{to_vector(start), Eigen::VectorXd(dimensions + 2), Eigen::VectorXd(dimensions + 2),
                        Eigen::VectorXd::Constant(dimensions + 2, typical_step)};
  box.lower.head(dimensions).setConstant(std::log(config.min_length_scale));
  box.upper.head(dimensions) =
      (config.max_length_scale_extents * extent).cwiseMax(2.0 * config.min_length_scale).array().log();
  box.lower(dimensions) = std::log(config.min_noise_variance);
  box.upper(dimensions) = std::log(std::max(2.0 * mean_square, 2.0 * config.min_noise_variance));
  box.lower(dimensions + 1) = -std::log(max_noise_to_signal);
  box.upper(dimensions + 1) = -std::log(config.min_noise_to_signal);
  return box;
}

struct Fit {
  Hyperparameters theta;
  Eigen::MatrixXd pseudo_inputs;
};

/// Z and theta by gradient. Z stays within a length scale of the data. Each point of Z explains a part of the data
/// only, so the log marginal likelihood has less curvature in it than in theta.
Fit optimise(const GpData& centred, const Hyperparameters& start, const GpConfig& config) {
  const detail::SearchBox of_theta = theta_box(start, centred, config);
  const Eigen::MatrixXd first = choose_greedily(centred, start.kernel, config).first;
  const Eigen::Index dimensions = first.rows(), size = first.cols(), numbers = first.size();
  const Eigen::Index all = numbers + dimensions + 2;
  const Eigen::VectorXd margin = start.kernel.length_scales;
  const double share = static_cast<double>(size) / static_cast<double>(centred.inputs.cols());
  detail::SearchBox box{Eigen::VectorXd(all), Eigen::VectorXd(all), Eigen::VectorXd(all), Eigen::VectorXd(all)};
  box.start << first.reshaped(), of_theta.start;
  box.lower << (centred.inputs.rowwise().minCoeff() - margin).replicate(size, 1), of_theta.lower;
  box.upper << (centred.inputs.rowwise().maxCoeff() + margin).replicate(size, 1), of_theta.upper;
  box.typical_step << (std::sqrt(share) * margin).replicate(size, 1), of_theta.typical_step;
  const auto unpack = [&](const Eigen::VectorXd& v) {
    return Fit{to_hyperparameters(v.tail(dimensions + 2)), v.head(numbers).reshaped(dimensions, size)};
  };
  const auto objective = [&](const Eigen::VectorXd& v) {
    const Fit fit = unpack(v);
    const MarginalLikelihoodGradient gradient =
        negative_log_marginal_likelihood_gradient(centred, fit.theta, fit.pseudo_inputs);
    detail::ValueAndGradient result{gradient.value, Eigen::VectorXd(all)};
    result.gradient << gradient.pseudo_inputs.reshaped(), gradient_of_vector(gradient);
    return result;
  };
  return unpack(detail::minimise_in_box(objective, box, config.max_iterations));
}

/// Greedy Z and theta as given.
SparseGp greedy_fit(const GpData& data, const Hyperparameters& theta, const Eigen::VectorXd& mean,
                    const GpConfig& config) {
  const auto [pseudo_inputs, lower] = choose_greedily(data, theta.kernel, config);
  SparseGp gp = detail::unchecked_prior(theta.kernel, theta.noise_variance, pseudo_inputs, mean, default_jitter);
  detail::add_data(gp, data, lower);
  return gp;
}

}  // namespace

SparseGp fit_sparse_gp(const GpData& data, const Hyperparameters& start, const GpConfig& config) {
  validate(config);
  validate(start);
  validate("fit_sparse_gp", data, start.kernel.length_scales.size(), data.outputs.cols());
  const Eigen::Index points = data.inputs.cols();
  const bool about_data = config.constant_mean == ConstantMean::data && points > 0;
  const Eigen::VectorXd mean = about_data ? Eigen::VectorXd(data.outputs.colwise().mean().transpose())
                                          : Eigen::VectorXd::Zero(data.outputs.cols()).eval();
  if (points == 0 || (points == 1 && about_data)) {
    SparseGp constant =
        prior_gp(start.kernel, start.noise_variance, Eigen::MatrixXd(start.kernel.length_scales.size(), 0), mean);
    constant.points = static_cast<double>(points);
    return constant;
  }
  const bool optimised = config.pseudo_inputs == PseudoInputChoice::optimised;
  if (!optimised || points < config.min_points_to_optimise) return greedy_fit(data, start, mean, config);
  const Fit fit = optimise({data.inputs, data.outputs.rowwise() - mean.transpose()}, start, config);
  return condition(prior_gp(fit.theta.kernel, fit.theta.noise_variance, fit.pseudo_inputs, mean), data);
}

}  // namespace sila
