#include "gp/fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "marginal_likelihood.hpp"
#include "minimise.hpp"
#include "statistics.hpp"

namespace sila {
namespace {

GpData about_mean(const GpData& data) {
  return {data.inputs, data.outputs.rowwise() - data.outputs.colwise().mean()};
}

Eigen::MatrixXd greedy_pseudo_inputs(const GpData& data, const Kernel& kernel, const GpConfig& config) {
  const Eigen::MatrixXd candidates = detail::candidates_for(kernel, data.inputs, config);
  return candidates(Eigen::all, detail::select_greedily(kernel, candidates, config.max_pseudo_inputs,
                                                        config.selection_stop, default_jitter)
                                    .chosen);
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

/// Bounds of theta for this number of points of this extent and mean square; the start, if outside, is clamped to them.
/// The curvature of the log marginal likelihood is about the number of points.
detail::SearchBox theta_box(const Hyperparameters& start, double points, const Eigen::VectorXd& extent,
                            double mean_square, const GpConfig& config) {
  constexpr double max_noise_to_signal = 10.0;
  const Eigen::Index dimensions = extent.size();
  detail::SearchBox box{to_vector(start), Eigen::VectorXd(dimensions + 2), Eigen::VectorXd(dimensions + 2),
                        Eigen::VectorXd::Constant(dimensions + 2, 1.0 / std::sqrt(points))};
  box.lower.head(dimensions).setConstant(std::log(config.min_length_scale));
  box.upper.head(dimensions) =
      (config.max_length_scale_extents * extent).cwiseMax(2.0 * config.min_length_scale).array().log();
  box.lower(dimensions) = std::log(config.min_noise_variance);
  box.upper(dimensions) = std::log(std::max(2.0 * mean_square, 2.0 * config.min_noise_variance));
  box.lower(dimensions + 1) = -std::log(max_noise_to_signal);
  box.upper(dimensions + 1) = -std::log(config.min_noise_to_signal);
  return box;
}

Eigen::VectorXd extent_of(const Eigen::MatrixXd& inputs) {
  return inputs.rowwise().maxCoeff() - inputs.rowwise().minCoeff();
}

double mean_square(const GpData& centred) {
  return centred.outputs.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, centred.outputs.size()));
}

/// theta that maximises the summed log marginal likelihood with Z kept.
Hyperparameters optimise_theta(const std::vector<GpData>& sets, const std::vector<Eigen::MatrixXd>& pseudo_inputs,
                               const detail::SearchBox& box, const GpConfig& config) {
  const auto objective = [&](const Eigen::VectorXd& v) {
    const Hyperparameters theta = to_hyperparameters(v);
    detail::ValueAndGradient sum{0.0, Eigen::VectorXd::Zero(v.size())};
    for (std::size_t i = 0; i < sets.size(); ++i) {
      const MarginalLikelihoodGradient gradient =
          negative_log_marginal_likelihood_gradient(sets[i], theta, pseudo_inputs[i]);
      sum.value += gradient.value;
      sum.gradient += gradient_of_vector(gradient);
    }
    return sum;
  };
  return to_hyperparameters(detail::minimise_in_box(objective, box, {.max_iterations = config.max_iterations}).x);
}

/// Greedy Z under the theta so far, then theta under that Z, some rounds.
Hyperparameters alternate(const std::vector<GpData>& sets, detail::SearchBox box, const GpConfig& config) {
  Hyperparameters theta = to_hyperparameters(box.start);
  for (int round = 0; round < config.pooling_rounds; ++round) {
    std::vector<Eigen::MatrixXd> pseudo_inputs;
    for (const GpData& set : sets) pseudo_inputs.push_back(greedy_pseudo_inputs(set, theta.kernel, config));
    theta = optimise_theta(sets, pseudo_inputs, box, config);
    box.start = to_vector(theta);
  }
  return theta;
}

struct Fit {
  Hyperparameters theta;
  Eigen::MatrixXd pseudo_inputs;
};

/// Z by gradient, and theta with it if `with_theta`. Z stays within a length scale of the data. Each point of Z
/// explains a part of the data only, so the log marginal likelihood has less curvature in it than in theta.
Fit optimise_jointly(const GpData& centred, const Fit& start, const detail::SearchBox& theta_box, bool with_theta,
                     const GpConfig& config) {
  const Eigen::Index dimensions = centred.inputs.rows();
  const Eigen::Index size = start.pseudo_inputs.cols();
  const Eigen::Index numbers = dimensions * size;
  const Eigen::Index all = numbers + (with_theta ? dimensions + 2 : 0);
  const Eigen::VectorXd margin = start.theta.kernel.length_scales;
  const double share = static_cast<double>(size) / static_cast<double>(centred.inputs.cols());
  detail::SearchBox box{Eigen::VectorXd(all), Eigen::VectorXd(all), Eigen::VectorXd(all), Eigen::VectorXd(all)};
  box.start.head(numbers) = start.pseudo_inputs.reshaped();
  box.lower.head(numbers) = (centred.inputs.rowwise().minCoeff() - margin).replicate(size, 1);
  box.upper.head(numbers) = (centred.inputs.rowwise().maxCoeff() + margin).replicate(size, 1);
  box.typical_step.head(numbers) = (std::sqrt(share) * margin).replicate(size, 1);
  if (with_theta) {
    box.start.tail(dimensions + 2) = theta_box.start;
    box.lower.tail(dimensions + 2) = theta_box.lower;
    box.upper.tail(dimensions + 2) = theta_box.upper;
    box.typical_step.tail(dimensions + 2) = theta_box.typical_step;
  }
  const auto unpack = [&](const Eigen::VectorXd& v) {
    return Fit{with_theta ? to_hyperparameters(v.tail(dimensions + 2)) : start.theta,
               v.head(numbers).reshaped(dimensions, size)};
  };
  const auto objective = [&](const Eigen::VectorXd& v) {
    const Fit fit = unpack(v);
    const MarginalLikelihoodGradient gradient =
        negative_log_marginal_likelihood_gradient(centred, fit.theta, fit.pseudo_inputs);
    detail::ValueAndGradient result{gradient.value, Eigen::VectorXd(all)};
    result.gradient.head(numbers) = gradient.pseudo_inputs.reshaped();
    if (with_theta) result.gradient.tail(dimensions + 2) = gradient_of_vector(gradient);
    return result;
  };
  return unpack(detail::minimise_in_box(objective, box, {.max_iterations = config.max_iterations}).x);
}

Fit optimised_fit(const GpData& data, const Hyperparameters& start, const GpConfig& config) {
  const GpData centred = about_mean(data);
  const detail::SearchBox box =
      theta_box(start, static_cast<double>(data.inputs.cols()), extent_of(data.inputs), mean_square(centred), config);
  const bool with_theta = config.hyperparameters == HyperparameterChoice::optimised;
  if (config.pseudo_inputs == PseudoInputChoice::optimised) {
    return optimise_jointly(centred, {start, greedy_pseudo_inputs(data, start.kernel, config)}, box, with_theta,
                            config);
  }
  const Hyperparameters theta = alternate({centred}, box, config);
  return {theta, greedy_pseudo_inputs(data, theta.kernel, config)};
}

/// Greedy Z and theta as given. The factor of k(Z, Z) is known from the selection.
SparseGp greedy_fit(const GpData& data, const Hyperparameters& theta, const Eigen::VectorXd& mean,
                    const GpConfig& config) {
  const Eigen::MatrixXd candidates = detail::candidates_for(theta.kernel, data.inputs, config);
  const detail::Selection selection = detail::select_greedily(theta.kernel, candidates, config.max_pseudo_inputs,
                                                              config.selection_stop, default_jitter);
  SparseGp gp = detail::unchecked_prior(theta.kernel, theta.noise_variance, candidates(Eigen::all, selection.chosen),
                                        mean, default_jitter);
  detail::add_data(gp, data,
                   detail::whitened(selection.lower, covariance(theta.kernel, data.inputs, gp.pseudo_inputs)));
  return gp;
}

}  // namespace

SparseGp fit_sparse_gp(const GpData& data, const Hyperparameters& start, const GpConfig& config) {
  validate(config), validate(start);
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
  const bool optimises =
      config.pseudo_inputs == PseudoInputChoice::optimised || config.hyperparameters == HyperparameterChoice::optimised;
  if (!optimises || points < config.min_points_to_optimise) return greedy_fit(data, start, mean, config);
  const Fit fit = optimised_fit(data, start, config);
  return condition(prior_gp(fit.theta.kernel, fit.theta.noise_variance, fit.pseudo_inputs, mean), data.inputs,
                   data.outputs);
}

Hyperparameters pool_hyperparameters(std::span<const GpData> sets, const Hyperparameters& start,
                                     const GpConfig& config) {
  validate(config), validate(start);
  const Eigen::Index dimensions = start.kernel.length_scales.size();
  std::vector<GpData> centred;
  Eigen::VectorXd extent = Eigen::VectorXd::Zero(dimensions);
  double squares = 0.0, points = 0.0;
  for (const GpData& set : sets) {
    validate("pool_hyperparameters", set, dimensions, set.outputs.cols());
    if (set.inputs.cols() < 2) continue;
    centred.push_back(about_mean(set));
    extent = extent.cwiseMax(extent_of(set.inputs));
    squares = std::max(squares, mean_square(centred.back()));
    points += static_cast<double>(set.inputs.cols());
  }
  if (centred.empty()) return start;
  return alternate(centred, theta_box(start, points, extent, squares, config), config);
}

}  // namespace sila
