#pragma once

#include <vector>

#include "sila/gp/config.hpp"
#include "sila/model/increment.hpp"

namespace sila::detail {

/// The transitions that become one, by what is known of them.
struct FieldSources {
  std::vector<const Transition*> stored;  ///< their data are gone
  std::vector<const Transition*> fresh;   ///< their samples are at hand: `samples`, in the same order
  std::vector<const TransitionSamples*> samples;
};

enum class FieldOrigin { copied, refitted, fused };

FieldOrigin origin_of(const FieldSources& sources);

/// One flow field of all. A single source is copied bit for bit; samples stand in for the GPs that were trained on
/// them, never both. Source: SILA paper, Alg. 2, FuseGP; algorithms 3.3. Differs: docs/decisions/0045.
FlowField fuse_fields(const FieldSources& sources, const GpConfig& config);

/// One outlook of all, in the same way; no points if no source has one.
SparseGp fuse_outlooks(const FieldSources& sources, const GpConfig& config);

}  // namespace sila::detail
