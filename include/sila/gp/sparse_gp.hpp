#pragma once

#include <Eigen/Core>
#include <array>

namespace sila {

/// Squared exponential with one length scale per input dimension:
/// k(x, z) = signal_variance * exp(-1/2 * sum_d (x_d - z_d)^2 / length_scales_d^2). Source: docs/gp.md, section 1.
/// Invariant: everything positive and finite, at least one dimension.
struct Kernel {
  double signal_variance = 1.0;
  Eigen::VectorXd length_scales = Eigen::VectorXd::Ones(2);
};

/// Exactly the same numbers.
bool operator==(const Kernel& a, const Kernel& b);

/// Shapes: a is D x n, b is D x m (one point a column); the result is n x m.
/// Throws: std::invalid_argument if a or b has not D rows or the kernel is not valid.
Eigen::MatrixXd covariance(const Kernel& kernel, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Throws: std::invalid_argument naming the first number that is not positive and finite.
void validate(const Kernel& kernel);

/// Data of one GP. Shapes: inputs D x n (one point a column), outputs n x P.
struct GpData {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
};

/// Added to the diagonal of k(Z, Z), relative to the signal variance, so that its Cholesky factor exists.
inline constexpr double default_jitter = 1e-6;

/// A sparse Gaussian process (FITC: fully independent training conditional) with P outputs that share pseudo-inputs,
/// kernel and noise, stored as whitened sufficient statistics: data can be added and models merged without the earlier
/// data. D inputs, M pseudo-inputs, P outputs. Outputs are modelled as mean + GP of zero mean. M = 0 is the constant
/// mean with the prior's variance. V = L_u \ k(Z, X), L_u = chol(k(Z, Z) + jitter * signal_variance * I), lambda the
/// noise of each point. Source: docs/gp.md, sections 1 and 2.
struct SparseGp {
  Kernel kernel;
  double noise_variance = 1.0;
  Eigen::MatrixXd pseudo_inputs;   ///< D x M, Z
  Eigen::VectorXd mean;            ///< P, constant mean of each output
  Eigen::MatrixXd information;     ///< M x M, G = V diag(1/lambda) V'; symmetric bit for bit
  Eigen::MatrixXd response;        ///< M x P, h = V diag(1/lambda) (y - mean)
  Eigen::VectorXd mean_response;   ///< M, e = V diag(1/lambda) 1; lets the constant mean be changed later
  double points = 0.0;             ///< number of data points, n
  double jitter = default_jitter;  ///< relative to signal_variance; part of what the statistics are whitened with
};

/// Exactly the same numbers.
bool operator==(const SparseGp& a, const SparseGp& b);

/// A GP without data. If k(Z, Z) has no Cholesky factor with `jitter`, jitter is multiplied by 10 up to 1e-2; the GP
/// stores the value that worked. Shapes: pseudo_inputs D x M, mean P. Throws: std::invalid_argument for wrong shapes or
/// numbers; NumericalError if no jitter is sufficient. Source: docs/gp.md, section 1.
SparseGp prior_gp(const Kernel& kernel, double noise_variance, const Eigen::MatrixXd& pseudo_inputs,
                  const Eigen::VectorXd& mean, double jitter = default_jitter);

/// Adds data under the GP's own pseudo-inputs and kernel; exact, in any order.
/// Shapes: inputs D x n, outputs n x P.
/// Throws: std::invalid_argument for wrong shapes or NaN. Source: docs/gp.md, section 2 (FITC).
SparseGp condition(const SparseGp& gp, const GpData& data);

/// Throws: std::invalid_argument naming the first field of wrong shape, not finite, or out of range.
void validate(const SparseGp& gp);

/// Throws: std::invalid_argument, in the name of `function`, unless data has D rows of inputs, P columns of outputs,
/// equally many points, and only finite numbers.
void validate(const char* function, const GpData& data, Eigen::Index input_dimensions, Eigen::Index output_dimensions);

/// Kernel and noise of a GP, theta.
struct Hyperparameters {
  Kernel kernel;
  double noise_variance = 0.1;
};

/// Throws: std::invalid_argument naming the first number that is not positive and finite.
void validate(const Hyperparameters& hyperparameters);

/// Z chosen greedily and theta as given, or both by gradient of the marginal likelihood.
enum class PseudoInputChoice { greedy, optimised };
/// Fusion by transfer of the stored information (docs/gp.md, section 8), or by weighted pseudo-data (section 9).
enum class GpFusion { transfer, pseudo_data };
/// The constant mean of a GP: that of its data, or zero.
enum class ConstantMean { data, zero };

inline constexpr std::array<const char*, 2> pseudo_input_choice_names = {"greedy", "optimised"};
inline constexpr std::array<const char*, 2> gp_fusion_names = {"transfer", "pseudo_data"};

/// How sparse GPs are fitted and fused; the settings are those of `learn.field` and `fuse`. Lengths and variances are
/// in the units of the data.
struct GpConfig {
  PseudoInputChoice pseudo_inputs = PseudoInputChoice::greedy;
  ConstantMean constant_mean = ConstantMean::data;
  int max_pseudo_inputs = 30;  ///< maximum M of a fit
  /// The greedy choice stops when all conditional variances are below this [of the signal variance].
  double selection_stop = 0.01;
  /// With fewer points Z is chosen greedily and theta kept.
  static constexpr int min_points_to_optimise = 30;
  int max_iterations = 50;  ///< of the optimiser
  /// Bounds of an optimised theta: length scales at least this [units of the inputs] and at most this many extents of
  /// the data; noise variance at least this [units of the outputs squared] and at least this share of the signal
  /// variance.
  double min_length_scale = 0.5;
  static constexpr double max_length_scale_extents = 3.0;
  double min_noise_variance = 0.0025;
  static constexpr double min_noise_to_signal = 1e-3;
  GpFusion fusion = GpFusion::transfer;
  int max_fused_pseudo_inputs = 30;  ///< maximum M of a fusion
  /// A GP at its limit of pseudo-inputs that holds at least this share of all points keeps them when fused; 1: none
  /// does.
  double keep_pseudo_inputs_share = 0.9;
  /// More candidates are subsampled evenly [points].
  static constexpr int max_candidates = 500;
  /// Spacing of the lattice of candidates, so that none is a point of a track [length scales].
  static constexpr double lattice_step = 0.25;
};

/// Throws: std::invalid_argument for the first member out of its range.
void validate(const GpConfig& config);

}  // namespace sila
