#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sila/service/learner_thread.hpp"
#include "sila/service/stream.hpp"

namespace sila {

/// Upper edges of the bins of the prediction latency [s].
inline constexpr std::array<double, 12> kLatencyEdges_s = {0.001, 0.002, 0.005, 0.01, 0.02, 0.03,
                                                           0.05,  0.1,   0.2,   0.5,  1.0,  5.0};

struct LatencyHistogram {
  std::array<std::uint64_t, kLatencyEdges_s.size() + 1> counts = {};
  double sum_s = 0.0;
};
void add(LatencyHistogram& histogram, double seconds);

/// The state of a service as numbers.
struct ServiceMetrics {
  Counters counters;
  std::array<std::uint64_t, kRejections.size()> rejected = {};
  std::uint64_t lines = 0;                ///< read, by all connections together
  std::uint64_t slow_reader_dropped = 0;  ///< predictions that a connection did not read in time
  std::size_t connections = 0, live_pages = 0;
  std::size_t pedestrians = 0, due_predictions = 0, queued_lines = 0;
  LatencyHistogram latency;  ///< from reading a detection to sending its prediction
  std::vector<double> horizons_s;
  std::vector<HorizonSums> all, moving;  ///< over the recent pedestrians
  std::vector<std::array<double, kRegionProbabilities.size()>> coverage;
  std::size_t scored_pedestrians = 0;
  double novelty = 0.0;
  Drift drift;
  LearnerStatus learner;
  std::size_t model_size = 0, primitives = 0, transitions = 0;
  int model_episodes = 0;
  long model_tracks = 0;
};

/// Metrics of the core and the learner; those of the engine and the connections are zero.
ServiceMetrics core_metrics(const StreamCore& core, const LearnerThread& learner, const ServiceSettings& settings);

/// Text format of Prometheus, version 0.0.4.
std::string metrics_text(const ServiceMetrics& metrics);

/// JSON for the live page.
std::string metrics_message(const ServiceMetrics& metrics);

}  // namespace sila
