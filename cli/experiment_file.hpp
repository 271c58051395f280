#pragma once

// Experiment files: JSON to an Experiment, the tracks of its scenes read or simulated.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "options.hpp"
#include "sila/experiment/experiment.hpp"

namespace sila::cli {

struct ExperimentOptions {
  CommonOptions common;
  std::string file;
  std::string out;
  std::string data_dir;
  std::optional<int> trials;
  std::optional<SplitBy> split;
  bool redo = false;
};

struct ReadExperiment {
  Experiment experiment;
  std::string reference;                  ///< the method that the others are compared with
  nlohmann::ordered_json resolved;        ///< every value in force, defaults included
  std::vector<std::string> track_hashes;  ///< of each place
};

/// Reads and checks an experiment file (docs/experiments.md).
/// Throws: FormatError for what is not an experiment, unknown keys with the nearest known one; std::invalid_argument
/// for splits larger than the data and other contradictions.
ReadExperiment read_experiment(const ExperimentOptions& options);

/// FNV-1a of bytes, as 16 hexadecimal digits.
std::string hash_of(std::string_view bytes);

}  // namespace sila::cli
