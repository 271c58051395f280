#pragma once

#include <Eigen/Core>

#include "sila/core/trajectory.hpp"
#include "sila/model/outlook.hpp"

namespace sila {

/// How somebody has been walking, whatever the place: velocities [m/s] of the last 0.4, 0.8, 1.6 and 3 s ahead of and
/// to the left of the way of the last 0.8 s (whose leftward part is zero and left out).
inline constexpr int kGaitInputs = 7;
using GaitState = Eigen::Matrix<double, kGaitInputs, 1>;

/// Ahead of and to the left of the way of the last 0.8 s, as columns; the world's axes for somebody who stands.
Matrix2 gait_frame(const CurbTrajectory& observed);
GaitState gait_state(const CurbTrajectory& observed);

/// Examples of the model's gait: how walking has been, and how the path parted from constant velocity, each also seen
/// in a mirror. Shapes: inputs kGaitInputs x n, outputs n x 2 per knot [m/s], ahead and left.
struct GaitSamples {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
};
GaitSamples gait_samples(const std::vector<const OutlookExample*>& examples);

/// What is known of how walking goes on, and more examples of it. While the pseudo-inputs have room they grow; then the
/// examples are absorbed exactly.
SparseGp learn_gait(const SparseGp& known, const GaitSamples& samples, const OutlookConfig& config);

/// One gait of two whose examples are gone.
SparseGp fuse_gaits(const SparseGp& a, const SparseGp& b, const OutlookConfig& config);

/// What is known of walking where nothing was learnt: the people of one place walk more alike than those of two, so all
/// examples together count as `most_examples` at most. Source: none in the paper; docs/decisions/0073-gait.md.
SparseGp gait_elsewhere(SparseGp gait, double most_examples);

}  // namespace sila
