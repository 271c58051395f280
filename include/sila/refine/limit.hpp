#pragma once

#include <concepts>
#include <limits>
#include <type_traits>
#include <vector>

#include "sila/core/fields.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/compact.hpp"

namespace sila {

/// What a model may never exceed, whatever it is fitted.
struct ModelLimits {
  double max_primitives = std::numeric_limits<double>::infinity();
  double max_bytes = std::numeric_limits<double>::infinity();
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, ModelLimits>
void fields(Config& config, Visitor&& visit) {
  const double none = std::numeric_limits<double>::infinity();
  visit.number("max_primitives", config.max_primitives, Range{1.0, none}, "primitives",
               "the model never has more; what costs least is given up");
  visit.number("max_bytes", config.max_bytes, Range{1.0, none}, "bytes",
               "of all that was learnt, without the file's log of episodes; what costs least is given up");
}

/// What was given up to stay within the limits.
struct LimitReport {
  int primitives = 0;
  int transitions = 0;
  double count = 0.0;  ///< of those transitions: how often a pedestrian was seen there
  int narrowed = 0;    ///< residual GPs that stay with fewer pseudo-inputs; twice narrowed counts twice
};

/// A model within its limits and how it came about.
struct Limited {
  Model model;
  LimitReport report;
  std::vector<int> kept;  ///< the primitives that stay, by their old index
};

/// Gives up the transitions of least worth until the model is within the limits; where bytes are short, detail of
/// residual GPs before that. Worth is how often a transition was
/// seen times the share of its field that no other one knows and agrees with (as `compact` judges that), a quarter at
/// least because its residual GP goes as well; where bytes are short, worth per byte, where primitives are short, the
/// worth of all transitions that touch one. Throws: std::invalid_argument for a field out of range, or if not even one
/// transition fits. Source: none in the paper; docs/decisions/0048-limits.md.
Limited limit(Model model, const ModelLimits& limits, const CompactConfig& coverage = {});

}  // namespace sila
