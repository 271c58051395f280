#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <map>
#include <string>

#include "core/kinematics.hpp"
#include "sila/evaluate/training_support.hpp"

namespace sila {
namespace {

constexpr std::size_t kFolds = 5;
constexpr std::array kRidges = {1e-4, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3};
/// No error is taken to be smaller [m²].
constexpr double kLeastVariance_m2 = 1e-4;

/// Ahead and to the left of the way from the first to the last position, as columns.
Matrix2 heading_frame(std::span<const Vector2> past_m) {
  return axes_along(unit_along(past_m.back() - past_m.front()));
}

/// The observed positions relative to the last one, ahead and to the left, and a constant.
Eigen::VectorXd inputs_of(std::span<const Vector2> past_m) {
  const Matrix2 frame = heading_frame(past_m);
  Eigen::VectorXd inputs(2 * static_cast<Eigen::Index>(past_m.size()) - 1);
  for (std::size_t i = 0; i + 1 < past_m.size(); ++i)
    inputs.segment<2>(2 * static_cast<Eigen::Index>(i)) = frame.transpose() * (past_m[i] - past_m.back());
  inputs(inputs.size() - 1) = 1.0;
  return inputs;
}

/// The recorded path minus a predicted one, ahead and to the left [m]: x, y of the first step, of the second, ...
Eigen::RowVectorXd errors_of(std::span<const Vector2> path_m, const Window& window) {
  const Matrix2 frame = heading_frame(window.past_m);
  Eigen::RowVectorXd errors(2 * std::ssize(path_m));
  for (std::size_t j = 0; j < path_m.size(); ++j)
    errors.segment<2>(2 * static_cast<Eigen::Index>(j)) = frame.transpose() * (window.future_m[j] - path_m[j]);
  return errors;
}

/// The sums of a ridge regression.
struct Sums {
  Eigen::MatrixXd inputs, products;

  Eigen::MatrixXd solve(double ridge) const {
    Eigen::MatrixXd matrix = inputs;
    matrix.diagonal().array() += ridge;
    return matrix.ldlt().solve(products);
  }
};

struct Regression {
  Eigen::MatrixXd weights;
  Eigen::MatrixXd errors;  ///< of each window, when its fold was held back
};

/// The fold of each window; all windows of a person are in one fold.
std::vector<std::size_t> folds_of(std::span<const Window* const> windows) {
  std::map<std::string, std::size_t> fold_of;
  std::vector<std::size_t> folds;
  for (const Window* window : windows)
    folds.push_back(fold_of.try_emplace(person_of(window->observed.id), fold_of.size() % kFolds).first->second);
  return folds;
}

Regression regress(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& targets,
                   const std::vector<std::size_t>& folds) {
  std::vector<Sums> without(kFolds, {inputs.transpose() * inputs, inputs.transpose() * targets});
  const Sums all = without.front();
  for (std::size_t i = 0; i < folds.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    without[folds[i]].inputs -= inputs.row(row).transpose() * inputs.row(row);
    without[folds[i]].products -= inputs.row(row).transpose() * targets.row(row);
  }
  Regression best;
  double least = std::numeric_limits<double>::infinity();
  for (const double ridge : kRidges) {
    Eigen::MatrixXd errors(targets.rows(), targets.cols());
    std::vector<Eigen::MatrixXd> weights;
    for (const Sums& sums : without) weights.push_back(sums.solve(ridge));
    for (std::size_t i = 0; i < folds.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      errors.row(row) = targets.row(row) - inputs.row(row) * weights[folds[i]];
    }
    const double error = errors.squaredNorm();
    if (error < least) {
      least = error;
      best = {all.solve(ridge), std::move(errors)};
    }
  }
  return best;
}

std::vector<Matrix2> covariances_of(const Eigen::MatrixXd& errors) {
  std::vector<Matrix2> covariances_m2;
  const double share = 1.0 / static_cast<double>(std::max<Eigen::Index>(1, errors.rows()));
  for (Eigen::Index j = 0; j < errors.cols(); j += 2) {
    const auto of_step = errors.middleCols<2>(j);
    covariances_m2.emplace_back(share * of_step.transpose() * of_step + kLeastVariance_m2 * Matrix2::Identity());
  }
  return covariances_m2;
}

/// For each step the share of constant velocity of the least squared error.
std::vector<double> damped_shares(std::span<const Window* const> windows, std::size_t steps, double interval_s) {
  std::vector<double> shares;
  for (std::size_t j = 0; j < steps; ++j) {
    double product = 0.0, square = 0.0;
    for (const Window* window : windows) {
      const Vector2 here = window->past_m.back();
      const Vector2 way = constant_velocity(window->past_m, static_cast<int>(j) + 1, interval_s).back() - here;
      product += way.dot(window->future_m[j] - here);
      square += way.squaredNorm();
    }
    shares.push_back(square > 0.0 ? product / square : 1.0);
  }
  return shares;
}

/// The errors of a reference without a regression.
Eigen::MatrixXd errors_of(const LinearReference& reference, std::span<const Window* const> windows, double interval_s) {
  Eigen::MatrixXd errors(std::ssize(windows), 2 * std::ssize(reference.covariances_m2));
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    const Window& window = *windows[static_cast<std::size_t>(i)];
    errors.row(i) = errors_of(reference.predict(window.past_m, interval_s).modes.front().path_m, window);
  }
  return errors;
}

LinearReference fit_linear(std::span<const Window* const> windows, std::size_t steps, double interval_s,
                           LinearReference reference) {
  const auto rows = static_cast<Eigen::Index>(windows.size());
  Eigen::MatrixXd inputs(rows, inputs_of(windows.front()->past_m).size()),
      targets(rows, 2 * static_cast<Eigen::Index>(steps));
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Window& window = *windows[static_cast<std::size_t>(i)];
    inputs.row(i) = inputs_of(window.past_m).transpose();
    targets.row(i) = errors_of(constant_velocity(window.past_m, static_cast<int>(steps), interval_s), window);
  }
  Regression regression = regress(inputs, targets, folds_of(windows));
  reference.weights = std::move(regression.weights);
  reference.covariances_m2 = covariances_of(regression.errors);
  return reference;
}

}  // namespace

Prediction LinearReference::predict(std::span<const Vector2> past_m, double interval_s) const {
  const std::size_t steps = covariances_m2.size();
  const Matrix2 frame = heading_frame(past_m);
  const Vector2 here = past_m.back();
  Mode mode{1.0, constant_velocity(past_m, static_cast<int>(steps), interval_s), {}, {}};
  Eigen::VectorXd added_m;
  if (weights.size() > 0) added_m = weights.transpose() * inputs_of(past_m);
  Prediction prediction;
  for (std::size_t j = 0; j < steps; ++j) {
    if (!shares.empty()) mode.path_m[j] = here + shares[j] * (mode.path_m[j] - here);
    if (added_m.size() > 0) mode.path_m[j] += frame * added_m.segment<2>(2 * static_cast<Eigen::Index>(j));
    mode.covariances_m2.emplace_back(frame * covariances_m2[j] * frame.transpose());
    prediction.times_s.push_back(static_cast<double>(j + 1) * interval_s);
  }
  prediction.modes.push_back(std::move(mode));
  return prediction;
}

LinearReference unfitted_reference(Reference kind, std::size_t steps, double interval_s) {
  LinearReference reference{kind, {}, {}, {}};
  for (std::size_t j = 1; j <= steps; ++j) {
    const double deviation_m = static_cast<double>(j) * interval_s;
    reference.covariances_m2.emplace_back(deviation_m * deviation_m * Matrix2::Identity());
  }
  if (kind == Reference::stays) reference.shares.assign(steps, 0.0);
  return reference;
}

std::vector<LinearReference> fit_references(std::span<const Window* const> windows, std::size_t steps,
                                            double interval_s, std::size_t count) {
  std::vector<LinearReference> references;
  for (std::size_t r = 0; r < count; ++r) {
    LinearReference reference = unfitted_reference(static_cast<Reference>(r), steps, interval_s);
    if (reference.kind == Reference::damped_velocity) reference.shares = damped_shares(windows, steps, interval_s);
    if (!windows.empty() && reference.kind == Reference::linear)
      reference = fit_linear(windows, steps, interval_s, std::move(reference));
    else if (!windows.empty())
      reference.covariances_m2 = covariances_of(errors_of(reference, windows, interval_s));
    references.push_back(std::move(reference));
  }
  return references;
}

}  // namespace sila
