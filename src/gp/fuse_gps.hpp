#pragma once

#include <optional>
#include <span>

#include "sila/gp/sparse_gp.hpp"
#include "statistics.hpp"

namespace sila {

/// Fuses parts, whose data are gone, and new data into one GP. Give the data or the GP fitted to them, never both.
/// Kernel and noise are the points-weighted log mean of the parts' (bit-identical if they agree), the constant mean is
/// the points-weighted mean; pseudo-inputs are chosen greedily from those of the parts and the lattice points near the
/// data. Independent of the order of the parts up to rounding. `data_hyperparameters` is the theta of the data's own
/// fit: it joins the weighted mean. Shapes: data may be empty (0 points); each part has a point. Throws:
/// std::invalid_argument without a part, or if the shapes disagree. Source: docs/gp.md, section 8; config.fusion =
/// pseudo_data: section 9 (Suk, Wang, Lee 2012).
SparseGp fuse_gps(std::span<const SparseGp* const> parts, const GpData& data, const GpConfig& config = {},
                  const std::optional<Hyperparameters>& data_hyperparameters = std::nullopt);

/// A GP that is fused with others.
struct GpSource {
  const SparseGp* gp;
  const GpData* data = nullptr;  ///< that it was trained on; null: they are gone
};

/// The GP of all sources; without points if none has one. A single source is copied bit for bit. Data replace the GPs
/// that were trained on them, so no data counts twice.
SparseGp fuse_sources(std::span<const GpSource> sources, const GpConfig& config);

/// The same GP on at most `max_pseudo_inputs` of its pseudo-inputs, chosen greedily. Throws: as fuse_gps.
SparseGp reduce_pseudo_inputs(const SparseGp& gp, int max_pseudo_inputs);

/// Adds to `into` the statistics of `from`, without the data behind them; `from` may have other pseudo-inputs, another
/// kernel and another constant mean. The order of transfers does not matter. When pseudo-inputs, kernel and jitter are
/// the same, the statistics are added unchanged (exact); pseudo-inputs common to both are one variable, jitter
/// included, so that nothing is lost when `into` has all those of `from`. The variance that the new pseudo-inputs
/// cannot explain counts as noise, as in FITC. Throws: std::invalid_argument for different D or P. Source: docs/gp.md,
/// section 7. Differs: common pseudo-inputs, see docs/decisions/0011; Cholesky for the eigen-decomposition.
SparseGp transfer(const SparseGp& from, const SparseGp& into);

namespace detail {

/// The statistics that `transfer` adds. Shapes: lower = L_u of `into`, which gives kernel, pseudo-inputs, mean and
/// jitter; its own statistics are not used.
Statistics project(const SparseGp& from, const SparseGp& into, const Eigen::MatrixXd& lower);

/// True if the statistics of the two can be added unchanged.
bool same_basis(const SparseGp& a, const SparseGp& b);

}  // namespace detail

}  // namespace sila
