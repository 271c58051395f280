#include "gp/fuse_gps.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

#include "core/concatenate.hpp"
#include "core/indices.hpp"
#include "gp/fit.hpp"
#include "gp/posterior.hpp"

namespace sila {
namespace {

using Parts = std::span<const SparseGp* const>;

void require_parts(Parts parts, const GpData& data, const std::optional<Hyperparameters>& data_hyperparameters) {
  if (parts.empty()) throw invalid_argument("fuse_gps: parts is empty, there must be one");
  const Eigen::Index inputs = parts.front()->pseudo_inputs.rows(), outputs = parts.front()->mean.size();
  for (const SparseGp* part : parts) {
    validate(*part);
    if (part->pseudo_inputs.rows() == inputs && part->mean.size() == outputs) continue;
    throw invalid_argument("fuse_gps: parts are of ", inputs, " and ", part->pseudo_inputs.rows(), " inputs, ", outputs,
                           " and ", part->mean.size(), " outputs, must agree");
  }
  if (data_hyperparameters) validate(*data_hyperparameters);
  if (data.inputs.cols() > 0) validate("fuse_gps", data, inputs, outputs);
}

/// Signal variance, noise variance and length scales.
Eigen::ArrayXd theta_of(const Kernel& kernel, double noise_variance) {
  Eigen::ArrayXd theta(2 + kernel.length_scales.size());
  theta << kernel.signal_variance, noise_variance, kernel.length_scales.array();
  return theta;
}

/// The points-weighted log mean, bit-identical if all agree. Precondition: a part, and each part has a point.
Hyperparameters fused_hyperparameters(Parts parts, const std::optional<Hyperparameters>& of_data = std::nullopt,
                                      double data_points = 0.0) {
  const Eigen::ArrayXd first = theta_of(parts.front()->kernel, parts.front()->noise_variance);
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(first.size());
  Eigen::Array<bool, Eigen::Dynamic, 1> same = first == first;
  double weights = 0.0;
  const auto add = [&](const Eigen::ArrayXd& theta, double weight) {
    same = same && theta == first;
    sum += weight * theta.unaryExpr([](double value) { return std::log(value); });
    weights += weight;
  };
  for (const SparseGp* part : parts) add(theta_of(part->kernel, part->noise_variance), part->points);
  if (of_data && data_points > 0.0) add(theta_of(of_data->kernel, of_data->noise_variance), data_points);
  const Eigen::ArrayXd means = (sum / weights).unaryExpr([](double mean) { return std::exp(mean); });
  const Eigen::ArrayXd fused = same.select(first, means);  // equal numbers stay as they are, bit for bit
  return {{fused(0), fused.tail(fused.size() - 2)}, fused(1)};
}

Eigen::VectorXd fused_mean(Parts parts, const GpData& data, ConstantMean choice) {
  if (choice == ConstantMean::zero) return Eigen::VectorXd::Zero(parts.front()->mean.size());
  const bool same = data.inputs.cols() == 0 && std::all_of(parts.begin(), parts.end(), [&](const SparseGp* part) {
                      return part->mean == parts.front()->mean;
                    });
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

bool one_basis(Parts parts, const Kernel& kernel) {
  return parts.front()->kernel == kernel && std::all_of(parts.begin(), parts.end(), [&](const SparseGp* part) {
           return detail::same_basis(*part, *parts.front());
         });
}

/// The columns in lexicographic order.
std::vector<Eigen::Index> sorted_order(const Eigen::MatrixXd& points) {
  std::vector<Eigen::Index> order = indices<Eigen::Index>(static_cast<std::size_t>(points.cols()));
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::lexicographical_compare(points.col(a).begin(), points.col(a).end(), points.col(b).begin(),
                                        points.col(b).end());
  });
  return order;
}

/// The basis of the fused GP: Z_b, and the factor L_u of its covariance.
struct Basis {
  Eigen::MatrixXd pseudo_inputs;
  Eigen::MatrixXd lower;
  double jitter = default_jitter;
};

/// The common basis of the parts, extended by points near data that it does not explain; none if it becomes too large.
std::optional<Basis> grown_basis(const SparseGp& part, const Eigen::MatrixXd& fresh, const GpConfig& config) {
  const Eigen::Index kept = part.pseudo_inputs.cols();
  if (kept > config.max_fused_pseudo_inputs) return std::nullopt;
  Eigen::MatrixXd candidates(fresh.rows(), kept + fresh.cols());
  candidates << part.pseudo_inputs, fresh;
  auto selection = detail::select_greedily(part.kernel, candidates, config.max_fused_pseudo_inputs,
                                           config.selection_stop, part.jitter, kept);
  const bool complete = selection.remaining_variance <= config.selection_stop * part.kernel.signal_variance;
  if (!complete || !selection.sound) return std::nullopt;
  return Basis{candidates(Eigen::all, selection.chosen), std::move(selection.lower), part.jitter};
}

/// The part that holds nearly all points, if it is at its limit of pseudo-inputs.
const SparseGp* dominant_part(Parts parts, const GpData& data, const Kernel& kernel, const GpConfig& config) {
  const double points = std::transform_reduce(parts.begin(), parts.end(), static_cast<double>(data.inputs.cols()),
                                              std::plus<>(), [](const SparseGp* part) { return part->points; });
  const auto dominant = std::find_if(parts.begin(), parts.end(), [&](const SparseGp* part) {
    return part->points >= config.keep_pseudo_inputs_share * points && part->kernel == kernel &&
           part->pseudo_inputs.cols() >= config.max_fused_pseudo_inputs;
  });
  return dominant == parts.end() ? nullptr : *dominant;
}

/// If all parts have one basis it is kept and extended; a dominant part keeps its own; else all are candidates,
/// sorted so that the order of the parts does not matter.
Basis fused_basis(Parts parts, const GpData& data, const Kernel& kernel, const GpConfig& config) {
  const Eigen::MatrixXd fresh = data.inputs.cols() > 0 ? detail::candidates_for(kernel, data.inputs)
                                                       : Eigen::MatrixXd(kernel.length_scales.size(), 0);
  if (one_basis(parts, kernel)) {
    if (std::optional<Basis> grown = grown_basis(*parts.front(), fresh, config)) return *std::move(grown);
  }
  if (const SparseGp* dominant = dominant_part(parts, data, kernel, config))
    return {dominant->pseudo_inputs, detail::lower_factor(*dominant, "fuse_gps"), dominant->jitter};
  Eigen::MatrixXd candidates = fresh;
  for (const SparseGp* part : parts) {
    candidates.conservativeResize(Eigen::NoChange, candidates.cols() + part->pseudo_inputs.cols());
    candidates.rightCols(part->pseudo_inputs.cols()) = part->pseudo_inputs;
  }
  candidates = candidates(Eigen::all, sorted_order(candidates)).eval();
  auto selection = detail::select_greedily(kernel, candidates, config.max_fused_pseudo_inputs, config.selection_stop,
                                           default_jitter);
  return {candidates(Eigen::all, selection.chosen), std::move(selection.lower), default_jitter};
}

/// docs/gp.md, section 9: the posterior mean at the old pseudo-inputs replaces the old data, with the
/// same number of points.
detail::Statistics pseudo_data_statistics(const SparseGp& part, const SparseGp& into, const Eigen::MatrixXd& lower) {
  const Eigen::Index size = part.pseudo_inputs.cols();
  const Posterior posterior(part);
  GpData data{part.pseudo_inputs, Eigen::MatrixXd(size, part.mean.size())};
  Eigen::VectorXd mean(part.mean.size());
  for (Eigen::Index m = 0; m < size; ++m) {
    posterior.predict(std::span(part.pseudo_inputs.col(m).data(), posterior.inputs()),
                      std::span(mean.data(), posterior.outputs()));
    data.outputs.row(m) = mean.transpose();
  }
  const double times = part.points / static_cast<double>(size);
  return detail::statistics_of(into, lower, data, into.noise_variance / times);
}

/// Columns of `inputs` and rows of `outputs` of all parts.
GpData pooled(const std::vector<const GpData*>& parts) {
  Eigen::Index points = 0;
  for (const GpData* part : parts) points += part->inputs.cols();
  GpData data{Eigen::MatrixXd(parts.front()->inputs.rows(), points),
              Eigen::MatrixXd(points, parts.front()->outputs.cols())};
  Eigen::Index filled = 0;
  for (const GpData* part : parts) {
    data.inputs.middleCols(filled, part->inputs.cols()) = part->inputs;
    data.outputs.middleRows(filled, part->inputs.cols()) = part->outputs;
    filled += part->inputs.cols();
  }
  return data;
}

}  // namespace

SparseGp fuse_gps(Parts parts, const GpData& data, const GpConfig& config,
                  const std::optional<Hyperparameters>& data_hyperparameters) {
  validate(config);
  require_parts(parts, data, data_hyperparameters);
  const double data_points = static_cast<double>(data.inputs.cols());
  const Hyperparameters theta = fused_hyperparameters(parts, data_hyperparameters, data_points);
  const auto [pseudo_inputs, lower, jitter] = fused_basis(parts, data, theta.kernel, config);
  SparseGp fused = detail::unchecked_prior(theta.kernel, theta.noise_variance, pseudo_inputs,
                                           fused_mean(parts, data, config.constant_mean), jitter);
  for (const SparseGp* part : parts) {
    if (part->pseudo_inputs.cols() == 0) {  // only its constant mean is known
      fused.points += part->points;
    } else if (config.fusion == GpFusion::transfer) {
      detail::add(fused, detail::project(*part, fused, lower), part->points);
    } else {
      detail::add(fused, pseudo_data_statistics(*part, fused, lower), part->points);
    }
  }
  if (data_points > 0.0) detail::add_data(fused, data, lower);
  return fused;
}

SparseGp fuse_sources(std::span<const GpSource> sources, const GpConfig& config) {
  std::vector<const SparseGp*> stored, fresh;
  std::vector<const GpData*> data;
  for (const auto& [gp, data_of_gp] : sources) {
    if (!(gp->points > 0.0)) continue;
    (data_of_gp ? fresh : stored).push_back(gp);
    if (data_of_gp) data.push_back(data_of_gp);
  }
  if (stored.size() + fresh.size() == 0) return {};
  if (stored.size() + fresh.size() == 1) return stored.empty() ? *fresh.front() : *stored.front();
  if (fresh.empty()) return fuse_gps(stored, {}, config);
  const Hyperparameters of_data = fused_hyperparameters(fresh);
  return stored.empty() ? fit_sparse_gp(pooled(data), of_data, config)
                        : fuse_gps(stored, pooled(data), config, of_data);
}

SparseGp reduce_pseudo_inputs(const SparseGp& gp, int max_pseudo_inputs) {
  const auto chosen =
      detail::select_greedily(gp.kernel, gp.pseudo_inputs, max_pseudo_inputs, 0.0, default_jitter).chosen;
  return transfer(gp, prior_gp(gp.kernel, gp.noise_variance, gp.pseudo_inputs(Eigen::all, chosen), gp.mean));
}

}  // namespace sila
