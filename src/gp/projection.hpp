#pragma once

#include "statistics.hpp"

namespace sila::detail {

/// What a stored GP says about the pseudo-inputs of another, and its part of the streaming evidence (meaningful for
/// alpha = 1).
struct Projection {
  Statistics statistics;
  double log_evidence = 0.0;
};

/// Shapes: lower = L_u of `into`. `into` gives kernel, pseudo-inputs, mean and jitter; its own statistics play no part.
Projection project(const SparseGp& from, const SparseGp& into, const PaddedMatrix& lower, double alpha);

/// True if statistics of the two can be added as they are.
bool same_basis(const SparseGp& a, const SparseGp& b);

}  // namespace sila::detail
