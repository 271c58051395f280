#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "gp/fit.hpp"
#include "statistics.hpp"

namespace sila {
namespace {

/// The terms of docs/gp.md, section 4; features = V' and the like are n x M.
struct Factors {
  Eigen::MatrixXd own;    // K_uu without jitter
  Eigen::MatrixXd lower;  // L_u
  double jitter = 0.0;
  Eigen::MatrixXd cross;     // K_fu, n x M
  Eigen::MatrixXd features;  // V', n x M
  Eigen::ArrayXd lambda;
  Eigen::MatrixXd b_lower;   // L_B
  Eigen::MatrixXd whitened;  // c = L_B \ h, M x P
  double value = 0.0;
};

Factors factorise(const GpData& data, const Hyperparameters& hyperparameters, const Eigen::MatrixXd& pseudo_inputs,
                  double jitter) {
  validate(hyperparameters);
  const Kernel& kernel = hyperparameters.kernel;
  validate("negative_log_marginal_likelihood", data, kernel.length_scales.size(), data.outputs.cols());
  Factors f;
  f.own = covariance(kernel, pseudo_inputs, pseudo_inputs);
  const detail::KernelFactor factor =
      detail::factor_kernel_matrix(f.own, kernel.signal_variance, jitter, "negative_log_marginal_likelihood");
  f.lower = factor.lower;
  f.jitter = factor.jitter;
  f.cross = covariance(kernel, data.inputs, pseudo_inputs);
  f.features = detail::whitened(f.lower, f.cross);
  f.lambda =
      (kernel.signal_variance - f.features.rowwise().squaredNorm().array()).max(0.0) + hyperparameters.noise_variance;
  const Eigen::MatrixXd scaled = f.lambda.rsqrt().matrix().asDiagonal() * f.features;
  Eigen::MatrixXd seen = Eigen::MatrixXd::Identity(f.lower.rows(), f.lower.rows());
  seen.selfadjointView<Eigen::Lower>().rankUpdate(scaled.transpose());
  f.b_lower = Eigen::LLT<Eigen::MatrixXd>(seen).matrixL();
  const Eigen::MatrixXd response = f.features.transpose() * f.lambda.inverse().matrix().asDiagonal() * data.outputs;
  f.whitened = f.b_lower.triangularView<Eigen::Lower>().solve(response);

  const double outputs = static_cast<double>(data.outputs.cols());
  const double points = static_cast<double>(data.inputs.cols());
  const double shared = 0.5 * points * std::log(2.0 * std::numbers::pi) + 0.5 * f.lambda.log().sum() +
                        f.b_lower.diagonal().array().log().sum();
  const double squares = (data.outputs.array().square().colwise() / f.lambda).sum();
  f.value = outputs * shared + 0.5 * (squares - f.whitened.squaredNorm());
  return f;
}

/// The adjoints of K_fu (n x M) and K_uu (M x M), and sum_n w_n.
struct Adjoints {
  Eigen::MatrixXd cross;
  Eigen::MatrixXd own;
  double noise = 0.0;
};

/// The factors L_u^-1 on the right of V' are taken out of the sums, so that one triangular solve of n x M serves all.
Adjoints adjoints(const GpData& data, const Factors& f) {
  const double outputs = static_cast<double>(data.outputs.cols());
  const auto lower = f.lower.triangularView<Eigen::Lower>();
  const auto b_lower = f.b_lower.triangularView<Eigen::Lower>();
  const Eigen::Index size = f.lower.rows();
  const Eigen::MatrixXd weights = b_lower.transpose().solve(f.whitened);  // B^-1 h
  const Eigen::MatrixXd alpha =
      f.lambda.inverse().matrix().asDiagonal() * (data.outputs - f.features * weights);  // n x P
  const Eigen::MatrixXd b_inverse =
      b_lower.transpose().solve(b_lower.solve(Eigen::MatrixXd::Identity(size, size)));        // eigenvalues in (0, 1]
  const Eigen::MatrixXd shrunk = f.features * b_inverse;                                      // (B^-1 V)'
  const Eigen::ArrayXd reductions = shrunk.cwiseProduct(f.features).rowwise().sum().array();  // v_n' B^-1 v_n
  const Eigen::ArrayXd w =
      0.5 * (outputs * (f.lambda.inverse() - reductions / f.lambda.square()) - alpha.rowwise().squaredNorm().array());

  Adjoints result;
  result.cross = (outputs * f.lambda.inverse()).matrix().asDiagonal() * shrunk;
  result.cross.noalias() -= alpha * (alpha.transpose() * f.features);
  result.cross -= (2.0 * w).matrix().asDiagonal() * f.features;
  lower.solveInPlace<Eigen::OnTheRight>(result.cross);
  Eigen::MatrixXd half = -0.5 * result.cross.transpose() * f.features;  // times K_uu^-1 K_uf = V' L_u^-1
  lower.solveInPlace<Eigen::OnTheRight>(half);
  result.own = 0.5 * (half + half.transpose());
  result.noise = w.sum();
  return result;
}

}  // namespace

MarginalLikelihoodGradient negative_log_marginal_likelihood_gradient(const GpData& data,
                                                                     const Hyperparameters& hyperparameters,
                                                                     const Eigen::MatrixXd& pseudo_inputs,
                                                                     double jitter) {
  const Factors f = factorise(data, hyperparameters, pseudo_inputs, jitter);
  const Adjoints adjoint = adjoints(data, f);
  const double signal = hyperparameters.kernel.signal_variance;
  const Eigen::VectorXd& lengths = hyperparameters.kernel.length_scales;
  const Eigen::MatrixXd cross = adjoint.cross.cwiseProduct(f.cross);  // n x M
  const Eigen::MatrixXd own = adjoint.own.cwiseProduct(f.own);        // M x M

  MarginalLikelihoodGradient gradient;
  gradient.value = f.value;
  gradient.log_noise_variance = hyperparameters.noise_variance * adjoint.noise;
  gradient.log_signal_variance =
      cross.sum() + own.sum() + f.jitter * signal * adjoint.own.trace() + signal * adjoint.noise;
  gradient.pseudo_inputs.resizeLike(pseudo_inputs);
  gradient.log_length_scales.resize(lengths.size());
  const Eigen::VectorXd cross_rows = cross.rowwise().sum();
  const Eigen::VectorXd cross_columns = cross.colwise().sum().transpose();
  const Eigen::VectorXd own_columns = own.colwise().sum().transpose();
  for (Eigen::Index d = 0; d < lengths.size(); ++d) {
    // Squared differences are expanded; about the middle, so that little cancels.
    const double middle = pseudo_inputs.cols() > 0 ? pseudo_inputs.row(d).mean() : 0.0;
    const Eigen::VectorXd x = data.inputs.row(d).transpose().array() - middle;
    const Eigen::VectorXd z = pseudo_inputs.row(d).transpose().array() - middle;
    const double scale = 1.0 / (lengths(d) * lengths(d));
    const Eigen::VectorXd to_data = cross.transpose() * x;
    const Eigen::VectorXd to_others = own * z;
    gradient.log_length_scales(d) =
        scale * (x.cwiseAbs2().dot(cross_rows) + z.cwiseAbs2().dot(cross_columns) - 2.0 * z.dot(to_data) +
                 2.0 * z.cwiseAbs2().dot(own_columns) - 2.0 * z.dot(to_others));
    gradient.pseudo_inputs.row(d) =
        (scale * (to_data - z.cwiseProduct(cross_columns) + 2.0 * (to_others - z.cwiseProduct(own_columns))))
            .transpose();
  }
  return gradient;
}

}  // namespace sila
