#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "sila/gp/sparse_gp.hpp"

/// Shared by the sources of this folder.
namespace sila::detail {

/// Throws: std::invalid_argument unless the value is positive and finite.
void require_positive(const char* whose, const char* field, double value);

/// Single columns of a covariance matrix.
class CovarianceColumns {
 public:
  CovarianceColumns(const Kernel& kernel, const Eigen::MatrixXd& points);

  /// k(points, point), padded. Shapes: point is D.
  const Eigen::VectorXd& at(const double* point);

 private:
  Eigen::MatrixXd points_;  ///< one a row
  Eigen::VectorXd column_;
  Eigen::VectorXd inverse_;
  double signal_variance_;
};

/// chol(K + jitter * signal_variance * I) and the jitter that it took.
struct KernelFactor {
  Eigen::MatrixXd lower;
  double jitter = 0.0;
};

/// A = L L' -> L in the lower triangle, the only one that is read or written. False: A is not positive definite or not
/// finite, and its content is then undefined.
[[nodiscard]] bool cholesky_in_place(Eigen::MatrixXd& a);

/// Tries `jitter`, then ten times as much, up to 1e-2. Of the matrix only the lower triangle counts. Throws
/// NumericalError.
KernelFactor factor_kernel_matrix(const Eigen::MatrixXd& kernel_matrix, double signal_variance, double jitter,
                                  const char* function);

/// L_u of a GP, under exactly its own jitter, in the lower triangle. Throws NumericalError.
Eigen::MatrixXd lower_factor(const SparseGp& gp, const char* function);

/// A GP without data; the arguments are not checked.
SparseGp unchecked_prior(const Kernel& kernel, double noise_variance, const Eigen::MatrixXd& pseudo_inputs,
                         const Eigen::VectorXd& mean, double jitter);

/// The additive part of a SparseGp: whitened sums over data.
struct Statistics {
  Eigen::MatrixXd information;
  Eigen::MatrixXd response;
  Eigen::VectorXd mean_response;
};

/// V' = k(X, Z) L_u^-T from k(X, Z), both n x M.
Eigen::MatrixXd whitened(const Eigen::MatrixXd& lower, Eigen::MatrixXd cross);

/// The statistics of data under the pseudo-inputs, kernel and mean of a GP (FITC). Shapes: lower = L_u of the GP.
Statistics statistics_of(const SparseGp& gp, const Eigen::MatrixXd& lower, const GpData& data, double noise_variance);

void add(SparseGp& gp, const Statistics& statistics, double points);

/// Adds data. Shapes: lower = L_u of the GP.
void add_data(SparseGp& gp, const GpData& data, const Eigen::MatrixXd& lower);

/// The chosen candidates, in order, and results of the pivoted Cholesky that chose them.
struct Selection {
  std::vector<Eigen::Index> chosen;
  Eigen::MatrixXd lower;            ///< L_u of the chosen, with jitter
  double remaining_variance = 0.0;  ///< the largest conditional variance left
  bool sound = true;                ///< false: given candidates lie too close to one another for this jitter
};

/// Chooses pseudo-inputs from the candidates (pivoted Cholesky): repeatedly the one with the largest conditional
/// variance given those chosen so far, until `max_count` are chosen or the largest conditional variance is below
/// `stop_fraction` of the signal variance. Of candidates equal within 1e-9 the first is taken, so the choice is
/// deterministic. The first `given` candidates are taken before any other. Source: docs/gp.md, section 5.
Selection select_greedily(const Kernel& kernel, const Eigen::MatrixXd& candidates, Eigen::Index max_count,
                          double stop_fraction, double jitter, Eigen::Index given = 0);

/// Where pseudo-inputs may stand for data at `points`: the points of a lattice nearest to them, each once in the order
/// of the data, subsampled. A pseudo-input is kept in the model, and so must not be a point of a pedestrian's track
/// (docs/decisions/0094-pseudo-inputs-on-a-lattice.md).
Eigen::MatrixXd candidates_for(const Kernel& kernel, const Eigen::MatrixXd& points);

struct ValueAndGradient {
  double value = 0.0;
  Eigen::VectorXd gradient;
};

/// The start of the search, its box, and the typical steps: the distances by which each number must change for about
/// the same change of the objective. The optimiser works in units of these.
struct SearchBox {
  Eigen::VectorXd start, lower, upper, typical_step;
};

/// A local minimum in the box [lower, upper], by dlib's box-constrained L-BFGS; never worse than the start, which is
/// clamped to the box. See docs/decisions/0010 for the choice.
Eigen::VectorXd minimise_in_box(const std::function<ValueAndGradient(const Eigen::VectorXd&)>& objective,
                                const SearchBox& box, int max_iterations);

}  // namespace sila::detail
