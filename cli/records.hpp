#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sila/episode/episode.hpp"
#include "sila/io/model_store.hpp"

// What a model file is told of its episodes, by the program and by the Python package alike.
namespace sila::cli {

/// What the model file keeps of an episode; numbers count from 1.
inline EpisodeRecord record_of(int number, const EpisodeReport& report) {
  nlohmann::ordered_json statistics;
  statistics["standing"] = report.learn.standing;
  statistics["unexplained"] = report.learn.unexplained;
  statistics["batch_primitives"] = report.learn.primitives;
  statistics["batch_transitions"] = report.learn.transitions;
  return {number, report.tracks, report.seconds, report.size_before, report.size_after, statistics.dump()};
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
