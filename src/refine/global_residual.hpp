#pragma once

#include <vector>

#include "refine/residual.hpp"
#include "sila/core/trajectory.hpp"

namespace sila {

/// The heading frame: ahead of and to the left of the displacement of the last 0.8 s, as columns; the world's axes for
/// a pedestrian who stands.
Matrix2 heading_frame(const CurbTrajectory& observed);
GlobalResidualInput global_residual_input(const CurbTrajectory& observed);

GlobalResidualSamples global_residual_samples(const std::vector<const ResidualSample*>& examples);
GlobalResidualSamples join_samples(const std::vector<GlobalResidualSamples>& parts);

/// The global residual GP with more samples. Pseudo-inputs are added up to their limit; from there the samples are
/// added exactly.
SparseGp learn_global_residual(const SparseGp& known, const GlobalResidualSamples& samples,
                               const ResidualConfig& config);

/// Merges two global residual GPs whose samples are gone.
SparseGp merge_global_residuals(const SparseGp& a, const SparseGp& b, const ResidualConfig& config);

/// The global residual GP for an untrained site: pedestrians of one place walk more alike than those of two, so its
/// effective sample size is at most `most_examples`. Source: none in the paper;
/// docs/decisions/0073-global_residual.md.
SparseGp untrained_global_residual(SparseGp global_residual, double most_examples);

}  // namespace sila
