#pragma once

#include <nlohmann/json.hpp>

#include "sila/core/camera.hpp"
#include "sila/evaluate/compare.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/io/model_file.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// The members under their names.
nlohmann::ordered_json to_json(const BudgetReport& report);
nlohmann::ordered_json to_json(const PrequentialError& error);

/// x, y and direction [whole degrees] of each cell, one after the other.
nlohmann::ordered_json cells_json(const MotionPrimitive& primitive);

/// The change as a model file keeps it: the shapes of the primitives that are new or fused, and the transitions whose
/// count is another one. Its length depends on what changed, not on the size of the model.
nlohmann::ordered_json to_json(const ModelChange& change, const Model& previous, const Model& updated);

/// The record in the model file of an episode that began with `previous`; numbers count from 1. Its time is now.
EpisodeRecord record_of(int number, const Model& previous, const Episode& episode);

/// Number, tracks, duration and sizes of an episode.
nlohmann::ordered_json record_json(const EpisodeRecord& episode);

/// The episodes of both, renumbered in this order: those of a model that was fused from two.
std::vector<EpisodeRecord> joined(std::vector<EpisodeRecord> first, const std::vector<EpisodeRecord>& second);

/// A stored model in about a dozen lines for people.
std::string describe(const StoredModel& stored);

/// The same for programs: primitives, transitions, size, episodes, tracks, bytes and more.
nlohmann::ordered_json inspect_json(const StoredModel& stored);

/// The prequential error of each recorded episode that has one, and the number of tracks learnt before it. None for a
/// model fused from several: its records are those of all of them.
std::vector<LearningPoint> learning_points(const StoredModel& stored);

/// The error expected now and after half as many tracks again, in a sentence; empty if no curve can be fitted.
/// Throws: std::invalid_argument for invalid points, as fit_learning_curve, and if the model has no tracks.
std::string describe_learning(const Model& model, std::span<const LearningPoint> points);

/// The points, and the fitted curve with its sentence; `fit` is null if none can be fitted (docs/model-file.md).
nlohmann::ordered_json learning_json(const StoredModel& stored);

/// The episodes of a model as a table, one a line: number, when, tracks, seconds, sizes, how many primitives were
/// added, fused, split and lost ("-" where the record has no `change`), and the prequential error relative to constant
/// velocity. `oldest`: the earliest possible rollback.
std::string describe_log(const StoredModel& stored, int oldest);

/// The same for programs.
nlohmann::ordered_json log_json(const StoredModel& stored, int oldest);

/// How two models and their predictions on `windows` observed paths differ, for people.
std::string describe(const ModelComparison& difference, std::span<const HorizonDifference> predictions,
                     std::size_t windows);

/// The same for programs.
nlohmann::ordered_json to_json(const ModelComparison& difference, std::span<const HorizonDifference> predictions,
                               std::size_t windows);

/// Every metric under its name.
nlohmann::ordered_json to_json(const Metrics& metrics);

/// The means of each group at each horizon, the skipped tracks by reason; every metric under its name in `Metrics`.
nlohmann::ordered_json to_json(const Evaluation& evaluation);

/// The same for people: one line a group and horizon, the model beside constant velocity.
std::string to_text(const Evaluation& evaluation);

/// A sentence with the least number of these tracks that the model has learnt, as batches of the sizes of its episodes
/// in this order: errors on these tracks are too small. Empty if none is known to be learnt.
std::string warning_of_learnt(const StoredModel& stored, std::span<const FramedTrajectory> tracks);
/// What to say before the model learns: its first batch, `first`, is of another place, or some of `known`, the tracks
/// that are read already, were learnt in other batches.
std::vector<std::string> warnings_before_learning(const StoredModel& stored, std::span<const FramedTrajectory> first,
                                                  std::span<const FramedTrajectory> known);

/// A worked example of a fusion, read from a JSON file whose indices are 1-based (docs/fuse.md describes the keys).
struct FusionCase {
  std::string name;
  FusionProblem problem;  ///< 0-based
  FusionRules rules;
  nlohmann::json expect;  ///< as in the file, lists that are sets sorted
};

/// Throws: FormatError if the file cannot be read, is not JSON, lacks a key, or has an unknown key in `options` or
/// `expect`.
FusionCase read_fusion_case(const std::string& path);

/// The plan in the keys of `expect`, 1-based.
nlohmann::ordered_json to_case_json(const FusionPlan& plan);

/// The differences between a plan and the expectation of a case, one line for each key; empty if the plan gives exactly
/// what was expected.
std::vector<std::string> differences(const nlohmann::json& expect, const FusionPlan& plan);

/// A fusion that took place, as a case file (it can be run as one) with the reason of every component under `reasons`.
nlohmann::ordered_json explain_fusion(const std::string& name, const FusionProblem& problem, const FusionRules& rules,
                                      const FusionPlan& plan);

/// How a prediction is written as a line (docs/formats.md).
struct LineFormat {
  bool v1 = false;  ///< the first form: the times in each mode, every number in full
  /// Decimals of metres and seconds; shares, levels and covariances get one more. From 17 on every number is written in
  /// full: the shortest text that reads back as the same double.
  int digits = 3;
  bool outcomes = false;  ///< probabilities of sila/refine/outcomes.hpp
  bool covariances = true;
};

/// A prediction as one line of JSON without the line's end: seconds, metres, world frame; times after t0; covariances
/// as [xx, xy, yy], positive definite as written. With a camera also in the image, `u`, `v` and `cov_uv` [pixels]; null
/// behind it. t0 and the probabilities of regions are always in full.
/// Throws: std::invalid_argument for digits outside [1, 17].
std::string prediction_line(const std::string& track, const Prediction& prediction,
                            const Explanation* explanation = nullptr, const Camera* camera = nullptr,
                            const LineFormat& format = {});

/// Reads predictions of both forms; lines of other kinds (events of a live service) are skipped.
/// Throws: FormatError, with the line, for one that begins like a prediction and is none.
RecordedPredictions read_predictions(const std::filesystem::path& path);

}  // namespace sila
