#pragma once

#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sila/io/change_json.hpp"
#include "sila/io/model_store.hpp"
#include "sila/train/episode.hpp"

// What a model file is told of its episodes, by the program and by the Python package alike.
namespace sila::cli {

inline nlohmann::ordered_json to_json(const LimitReport& report) {
  return {{"primitives", report.primitives},
          {"transitions", report.transitions},
          {"count", report.count},
          {"narrowed", report.narrowed}};
}

inline std::int64_t seconds_since_1970() {
  using namespace std::chrono;
  return duration_cast<seconds>(system_clock::now().time_since_epoch()).count();
}

/// What the model file keeps of an episode that began with `previous`; numbers count from 1.
inline EpisodeRecord record_of(int number, const Model& previous, const Episode& episode) {
  const EpisodeReport& report = episode.report;
  nlohmann::ordered_json statistics;
  statistics["standing"] = report.learn.standing;
  statistics["unexplained"] = report.learn.unexplained;
  statistics["batch_primitives"] = report.learn.primitives;
  statistics["batch_transitions"] = report.learn.transitions;
  statistics["absorbed"] = report.compact.absorbed;
  statistics["forgotten"] = report.compact.forgotten;
  statistics["given_up"] = to_json(report.given_up);
  statistics["change"] = to_json(report.change, previous, episode.model);
  return {number,
          report.tracks,
          report.seconds,
          report.size_before,
          report.size_after,
          statistics.dump(),
          seconds_since_1970()};
}

/// The episodes of both, in order, so that the file tells where its model came from.
inline std::vector<EpisodeRecord> joined(std::vector<EpisodeRecord> first, const std::vector<EpisodeRecord>& second) {
  for (EpisodeRecord record : second) {
    record.number = static_cast<int>(first.size()) + 1;
    first.push_back(std::move(record));
  }
  return first;
}

}  // namespace sila::cli
