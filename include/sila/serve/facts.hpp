#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sila/live/learner.hpp"
#include "sila/live/live.hpp"

namespace sila {

/// Upper edges [s] of the bins of how long predictions took.
inline constexpr std::array<double, 12> kLatencyEdges_s = {0.001, 0.002, 0.005, 0.01, 0.02, 0.03,
                                                           0.05,  0.1,   0.2,   0.5,  1.0,  5.0};

struct LatencyHistogram {
  std::array<std::uint64_t, kLatencyEdges_s.size() + 1> counts = {};
  double sum_s = 0.0;
};
void add(LatencyHistogram& histogram, double seconds);

/// Everything that a service tells of itself.
struct Facts {
  Account account;
  std::array<std::uint64_t, kRefusals.size()> refused = {};
  std::uint64_t lines = 0;             ///< read, by all connections together
  std::uint64_t dropped_outgoing = 0;  ///< predictions that a connection read too slowly
  std::size_t connections = 0, watchers = 0;
  std::size_t streams = 0, people = 0, queued = 0, waiting_lines = 0;
  LatencyHistogram latency;  ///< from reading a detection to handing over its prediction
  std::vector<double> horizons_s;
  std::vector<HorizonSums> all, moving;  ///< of the pedestrians remembered
  std::vector<std::array<double, kRegionProbabilities.size()>> coverage;
  std::size_t remembered = 0;
  double novelty = 0.0;
  Drift drift;
  Learning learning;
  std::size_t model_size = 0, primitives = 0, transitions = 0;
  int model_episodes = 0;
  long model_tracks = 0;
};

/// Judges, counts and states of the core as of now; what the transport knows is left as it is.
void read_core(Facts& facts, const Live& live, const Learner& learner, const LiveSettings& settings);

/// Prometheus' text format, version 0.0.4.
std::string metrics_text(const Facts& facts);

/// What the live page shows of them.
nlohmann::ordered_json to_json(const Facts& facts);

}  // namespace sila
