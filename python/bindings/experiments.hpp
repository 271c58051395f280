#pragma once

#include "bindings.hpp"
#include "sila/evaluate/evaluate.hpp"

// Types that several bindings of the experiments share.
namespace sila::python {

/// Tracks of one or more sites, each with its frame.
struct FramedTracks {
  std::vector<FramedTrajectory> tracks;
};

/// Windows of tracks that have their whole future.
struct WindowSet {
  std::vector<Window> windows;
  double interval_s = 0.0;
  std::size_t steps = 0;
};

/// Every window by itself as JSON; metrics at the whole horizon.
std::string windows_json(const Evaluation& evaluation);

void bind_model_learner(nb::module_& module);

}  // namespace sila::python
