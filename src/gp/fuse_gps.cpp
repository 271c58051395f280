#include "sila/gp/fuse_gps.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "projection.hpp"
#include "sila/gp/posterior.hpp"

namespace sila {
namespace {

using Parts = std::vector<const SparseGp*>;

void require_parts(std::span<const SparseGp* const> parts, const GpData& data,
                   const std::optional<Hyperparameters>& data_hyperparameters) {
  if (parts.empty() && !data_hyperparameters) {
    throw std::invalid_argument("fuse_gps: parts is empty, so data_hyperparameters must be given");
  }
  const Eigen::Index outputs = parts.empty() ? data.outputs.cols() : parts.front()->mean.size();
  const Eigen::Index inputs =
      parts.empty() ? data_hyperparameters->kernel.length_scales.size() : parts.front()->pseudo_inputs.rows();
  for (const SparseGp* part : parts) {
    validate(*part);
    if (part->pseudo_inputs.rows() == inputs && part->mean.size() == outputs) continue;
    throw std::invalid_argument("fuse_gps: parts are of " + std::to_string(inputs) + " and " +
                                std::to_string(part->pseudo_inputs.rows()) + " inputs, " + std::to_string(outputs) +
                                " and " + std::to_string(part->mean.size()) + " outputs, must agree");
  }
  if (data_hyperparameters) validate(*data_hyperparameters);
  if (data.inputs.cols() > 0) validate("fuse_gps", data, inputs, outputs);
}

/// A weighted mean of logarithms that leaves equal numbers as they are, bit for bit.
class LogMean {
 public:
  void add(double value, double weight) {
    if (weight_ == 0.0) first_ = value;
    same_ = same_ && value == first_;
    sum_ += weight * std::log(value);
    weight_ += weight;
  }
  double value() const { return same_ ? first_ : std::exp(sum_ / weight_); }

 private:
  double first_ = 0.0;
  double sum_ = 0.0;
  double weight_ = 0.0;
  bool same_ = true;
};

Hyperparameters fused_hyperparameters(const Parts& parts, const std::optional<Hyperparameters>& of_data,
                                      double data_points) {
  const Eigen::Index dimensions =
      parts.empty() ? of_data->kernel.length_scales.size() : parts.front()->kernel.length_scales.size();
  LogMean signal;
  LogMean noise;
  std::vector<LogMean> lengths(static_cast<std::size_t>(dimensions));
  const auto add = [&](const Kernel& kernel, double noise_variance, double weight) {
    signal.add(kernel.signal_variance, weight);
    noise.add(noise_variance, weight);
    for (Eigen::Index d = 0; d < dimensions; ++d) {
      lengths[static_cast<std::size_t>(d)].add(kernel.length_scales(d), weight);
    }
  };
  for (const SparseGp* part : parts) add(part->kernel, part->noise_variance, part->points);
  if (of_data && (data_points > 0.0 || parts.empty())) {
    add(of_data->kernel, of_data->noise_variance, std::max(data_points, 1.0));
  }
  Hyperparameters fused{{signal.value(), Eigen::VectorXd(dimensions)}, noise.value()};
  for (Eigen::Index d = 0; d < dimensions; ++d) {
    fused.kernel.length_scales(d) = lengths[static_cast<std::size_t>(d)].value();
  }
  return fused;
}

Eigen::VectorXd fused_mean(const Parts& parts, const GpData& data) {
  const bool same =
      data.inputs.cols() == 0 && !parts.empty() &&
      std::all_of(parts.begin(), parts.end(), [&](const SparseGp* part) { return part->mean == parts.front()->mean; });
  if (same) return parts.front()->mean;
  Eigen::VectorXd sum = data.inputs.cols() > 0 ? Eigen::VectorXd(data.outputs.colwise().sum().transpose())
                                               : Eigen::VectorXd::Zero(parts.front()->mean.size()).eval();
  double points = static_cast<double>(data.inputs.cols());
  for (const SparseGp* part : parts) {
    sum += part->points * part->mean;
    points += part->points;
  }
  return sum / points;
}

bool one_basis(const Parts& parts, const Kernel& kernel) {
  return !parts.empty() && parts.front()->kernel == kernel &&
         std::all_of(parts.begin(), parts.end(),
                     [&](const SparseGp* part) { return detail::same_basis(*part, *parts.front()); });
}

Eigen::MatrixXd sorted_columns(const Eigen::MatrixXd& points) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(points.cols()));
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Eigen::Index>(i);
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::lexicographical_compare(points.col(a).begin(), points.col(a).end(), points.col(b).begin(),
                                        points.col(b).end());
  });
  return points(Eigen::all, order);
}

/// Z_b. Where all parts stand on one basis it is kept, and grows only by data on new ground; if that makes it too
/// large, and where the bases differ, all candidates compete, sorted so that the order of the parts does not matter.
Eigen::MatrixXd fused_pseudo_inputs(const Parts& parts, const GpData& data, const Kernel& kernel,
                                    const GpConfig& config) {
  const Eigen::MatrixXd fresh = detail::thinned(data.inputs, config.max_candidates);
  const Eigen::Index limit = config.max_fused_pseudo_inputs;
  if (one_basis(parts, kernel)) {
    const Eigen::MatrixXd& kept = parts.front()->pseudo_inputs;
    Eigen::MatrixXd candidates(kept.rows(), kept.cols() + fresh.cols());
    candidates << kept, fresh;
    const auto selection = detail::select_greedily(kernel, candidates, limit, config.selection_stop, kept.cols());
    const bool roomy = selection.remaining_variance <= config.selection_stop * kernel.signal_variance;
    if (kept.cols() <= limit && roomy) return candidates(Eigen::all, selection.chosen);
  }
  Eigen::Index count = fresh.cols();
  for (const SparseGp* part : parts) count += part->pseudo_inputs.cols();
  Eigen::MatrixXd candidates(kernel.length_scales.size(), count);
  candidates.leftCols(fresh.cols()) = fresh;
  Eigen::Index filled = fresh.cols();
  for (const SparseGp* part : parts) {
    candidates.middleCols(filled, part->pseudo_inputs.cols()) = part->pseudo_inputs;
    filled += part->pseudo_inputs.cols();
  }
  candidates = sorted_columns(candidates);
  return candidates(Eigen::all, detail::select_greedily(kernel, candidates, limit, config.selection_stop).chosen);
}

/// Algorithms 3.1: the posterior mean at the old pseudo-inputs stands for the old data, each point as often as it
/// takes.
detail::Statistics pseudo_data_statistics(const SparseGp& part, const SparseGp& into, const Eigen::MatrixXd& lower,
                                          double alpha) {
  const Eigen::Index size = part.pseudo_inputs.cols();
  const Posterior posterior(part);
  Eigen::MatrixXd residuals(size, part.mean.size());
  for (Eigen::Index m = 0; m < size; ++m) {
    residuals.row(m) = (posterior.predict(part.pseudo_inputs.col(m)).mean - into.mean).transpose();
  }
  const double times = part.points / static_cast<double>(size);
  return detail::whitened_statistics(lower, covariance(into.kernel, part.pseudo_inputs, into.pseudo_inputs), residuals,
                                     Eigen::VectorXd::Constant(size, into.noise_variance / times),
                                     into.kernel.signal_variance, alpha);
}

void add_data(SparseGp& gp, const GpData& data, const Eigen::MatrixXd& lower, double alpha) {
  if (data.inputs.cols() == 0) return;
  const Eigen::MatrixXd residuals = data.outputs.rowwise() - gp.mean.transpose();
  detail::add(gp,
              detail::whitened_statistics(lower, covariance(gp.kernel, data.inputs, gp.pseudo_inputs), residuals,
                                          Eigen::VectorXd::Constant(data.inputs.cols(), gp.noise_variance),
                                          gp.kernel.signal_variance, alpha),
              static_cast<double>(data.inputs.cols()));
}

/// A part of which only the constant mean is known.
bool no_statistics(const SparseGp& part) {
  return part.pseudo_inputs.cols() == 0;
}

}  // namespace

SparseGp fuse_gps(std::span<const SparseGp* const> parts, const GpData& data, const GpConfig& config,
                  const std::optional<Hyperparameters>& data_hyperparameters) {
  validate(config);
  require_parts(parts, data, data_hyperparameters);
  Parts known;
  std::copy_if(parts.begin(), parts.end(), std::back_inserter(known), [](const SparseGp* p) { return p->points > 0; });
  if (data.inputs.cols() == 0 && known.size() == 1) return *known.front();
  if (data.inputs.cols() == 0 && known.empty() && !parts.empty()) return *parts.front();
  const double data_points = static_cast<double>(data.inputs.cols());
  // Without a theta of anyone who has seen something, an empty part's is the best there is.
  const bool theta_known = !known.empty() || data_hyperparameters;
  const Hyperparameters theta = theta_known ? fused_hyperparameters(known, data_hyperparameters, data_points)
                                            : Hyperparameters{parts.front()->kernel, parts.front()->noise_variance};
  if (data_points == 0.0 && known.empty()) {
    return empty_gp(theta.kernel, theta.noise_variance, Eigen::MatrixXd(theta.kernel.length_scales.size(), 0),
                    Eigen::VectorXd::Zero(data.outputs.cols()));
  }

  const double jitter = one_basis(known, theta.kernel) ? known.front()->jitter : SparseGp{}.jitter;
  SparseGp fused = empty_gp(theta.kernel, theta.noise_variance, fused_pseudo_inputs(known, data, theta.kernel, config),
                            fused_mean(known, data), jitter);
  const Eigen::MatrixXd lower = detail::lower_factor(fused, "fuse_gps");
  for (const SparseGp* part : known) {
    if (no_statistics(*part)) {
      fused.points += part->points;
    } else if (config.fusion == GpFusion::transfer) {
      detail::add(fused, detail::project(*part, fused, lower, config.alpha).statistics, part->points);
    } else {
      detail::add(fused, pseudo_data_statistics(*part, fused, lower, config.alpha), part->points);
    }
  }
  add_data(fused, data, lower, config.alpha);
  return fused;
}

double log_streaming_evidence(std::span<const SparseGp* const> parts, const GpData& data, const SparseGp& prior) {
  require_parts(parts, data, Hyperparameters{prior.kernel, prior.noise_variance});
  validate(prior);
  const Eigen::MatrixXd lower = detail::lower_factor(prior, "log_streaming_evidence");
  SparseGp joint = prior;
  double evidence = 0.0;
  for (const SparseGp* part : parts) {
    const detail::Projection projection = detail::project(*part, prior, lower, 1.0);
    detail::add(joint, projection.statistics, part->points);
    evidence += projection.log_evidence;
  }
  add_data(joint, data, lower, 1.0);
  const Eigen::Index size = lower.rows();
  const double outputs = static_cast<double>(prior.mean.size());
  const Eigen::LLT<Eigen::MatrixXd> cholesky(Eigen::MatrixXd::Identity(size, size) + joint.information);
  evidence -= outputs * cholesky.matrixLLT().diagonal().array().log().sum();
  evidence += 0.5 * cholesky.matrixL().solve(joint.response).squaredNorm();
  if (data.inputs.cols() == 0) return evidence;
  Eigen::MatrixXd features = covariance(prior.kernel, data.inputs, prior.pseudo_inputs);
  lower.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(features);
  const Eigen::ArrayXd lambda =
      (prior.kernel.signal_variance - features.rowwise().squaredNorm().array()).max(0.0) + prior.noise_variance;
  const Eigen::ArrayXXd residuals = (data.outputs.rowwise() - prior.mean.transpose()).array();
  return evidence - 0.5 * ((residuals.square().colwise() / lambda).sum() +
                           outputs * (2.0 * std::numbers::pi * lambda).log().sum());
}

}  // namespace sila
