#include <algorithm>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "options.hpp"
#include "sila/refine/prune.hpp"
#include "sila/train/episode.hpp"

namespace sila::cli {
namespace {

struct LearnOptions {
  CommonOptions common;
  TrackOptions tracks;
  std::string model, units;
  int batch = ServiceConfig{}.batch;
  int min_people = 0;  ///< 0: nothing is shared
  std::string share;
};

void print_episode(int number, const EpisodeReport& report) {
  std::ostringstream line;
  line << "episode " << number << ": " << counted(report.tracks, "track") << ", size " << report.size_before << " -> "
       << report.size_after << ", " << std::fixed << std::setprecision(3) << report.seconds << " s";
  const PrequentialError& error = report.prequential;
  if (error.constant_m > 0.0) line << ", error " << error.ratio() << " of constant velocity";
  const BudgetReport& lost = report.budget;
  if (lost.transitions > 0) {
    line << "; over the limit, evicted " << counted(lost.primitives, "primitive") << " and "
         << counted(lost.transitions, "transition") << ", which " << std::setprecision(1) << lost.count
         << " tracks had shown";
  }
  if (lost.reduced > 0) line << "; over the limit, reduced " << counted(lost.reduced, "residual GP");
  std::cerr << line.str() << "\n";
}

/// The tracks in batches: a part of the input at a time, or, if some are held back, all that are left.
class Batches {
 public:
  Batches(const LearnOptions& options, const Config& config, const Model& start)
      : scaling_(config.episode.scaling), corners_(config.corners), size_(options.batch) {
    Scene given;
    if (options.tracks.hold_out > 0.0) {  // the tracks held back are drawn from all
      ReadTracks input = read_clean(options.tracks, config);
      given = std::move(input.scene);
      const std::size_t tracks = input.tracks.trajectories.size();
      Split split = held_out(without_frames(std::move(input.tracks.trajectories)), options.tracks, options.common);
      waiting_ = std::move(split.train);
      std::cerr << "--hold-out: " << counted(split.test.size(), "track") << " held back, "
                << tracks - split.test.size() - waiting_.size() << " left out because they were there at that time\n";
    } else {
      OpenedTracks opened = open_tracks(options.tracks, config);
      given = std::move(opened.scene);
      stream_ = std::move(opened.stream);
    }
    if (!given.corners.empty() || !start.sites.empty()) scene_ = scene_for(given, start, {}, corners_);
    warn({warning_of_moved_corner(start, given)});
  }

  /// Empty after the last.
  std::span<const FramedTrajectory> next() {
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(handed_out_));
    while (stream_ && waiting_.size() < static_cast<std::size_t>(size_)) {
      if (auto part = stream_->next())
        std::ranges::move(without_frames(std::move(part->trajectories)), std::back_inserter(waiting_));
      if (!stream_->exhausted()) continue;
      stream_->next();  // rejects what held no track at all
      tell(stream_->report());
      stream_.reset();
    }
    handed_out_ = std::min(waiting_.size(), static_cast<std::size_t>(size_));
    tracks_ += handed_out_;
    const std::span batch = std::span(waiting_).first(handed_out_);
    if (batch.empty()) return batch;
    if (!scene_) scene_ = scene_for({}, {}, batch, corners_);
    place(batch, *scene_, corners_, scaling_);
    return batch;
  }

  /// The last batch and what was read after it, in their frames.
  std::span<const FramedTrajectory> read_ahead() {
    if (scene_) place(waiting_, *scene_, corners_, scaling_);
    return waiting_;
  }

  /// Handed out so far.
  std::size_t tracks() const { return tracks_; }

 private:
  CurbScaling scaling_;
  CornerChoice corners_;
  int size_;
  std::optional<Scene> scene_;  ///< gives all tracks their frames; none before the first batch of a new model
  std::optional<TrackStream> stream_;
  std::vector<FramedTrajectory> waiting_;
  std::size_t handed_out_ = 0;
  std::size_t tracks_ = 0;
};

/// Writes the k-anonymous part of a model, without records of episodes and without earlier models.
void write_k_anonymous(const LearnOptions& options, const Model& model, const std::string& configuration) {
  StoredModel shared;
  shared.model = k_anonymous(model, options.min_people);
  shared.configuration = configuration;
  if (shared.model.empty()) {
    std::cerr << options.share << ": not written, for nothing in the model was shown by " << options.min_people
              << " different tracks yet\n";
    return;
  }
  save_model(options.share, shared);
  std::cerr << options.share << ": " << shared.model.primitives.size() << " of " << model.primitives.size()
            << " primitives, " << shared.model.transitions.size() << " of " << model.transitions.size()
            << " transitions, each shown by " << options.min_people << " different tracks or more\n";
}

/// The result of all episodes, on standard output, and how many batches were known, on stderr.
void print_result(const LearnOptions& options, const Training& run, std::size_t tracks) {
  const auto& [model, reports, known] = run;
  const int episodes = static_cast<int>(reports.size()) + known;
  if (known > 0) {
    std::cerr << known << " of " << episodes << " batches are in " << options.model
              << " already and were not learnt again"
              << (known < episodes ? "; if a file has grown, tracks of its last batch were learnt twice: give each "
                                     "period a file of its own\n"
                                   : "\n");
  }
  int subsumed = 0;
  BudgetReport evicted;
  for (const EpisodeReport& report : reports) {
    subsumed += report.prune.subsumed;
    evicted.primitives += report.budget.primitives;
    evicted.transitions += report.budget.transitions;
    evicted.count += report.budget.count;
    evicted.reduced += report.budget.reduced;
  }
  if (model.primitives.empty())
    warn({"no motion was learnt: the tracks are too few or too short, or not in metres and seconds"});
  print(options.common,
        {{"model", options.model},
         {"episodes", episodes},
         {"known", known},
         {"tracks", tracks},
         {"size", size(model)},
         {"subsumed", subsumed},
         {"evicted", to_json(evicted)}},
        options.model + ": " + counted(model.tracks, "track") + " in " + counted(model.episodes, "episode") + ", " +
            counted(model.primitives.size(), "primitive") + ", " + counted(model.transitions.size(), "transition") +
            "\n");
}

/// With fewer tracks than this a prior lowers the error by 1 to 4 % of that of constant velocity
/// (docs/results.md, "Few tracks and new places").
constexpr int kFewTracks = 100;

void recommend_prior(const Model& model) {
  const Refinement& kept = model.refinement;
  if (model.tracks >= kFewTracks || kept.error_statistics.empty() || !kept.prior.empty()) return;
  std::cerr << "hint: a new model of fewer than " << kFewTracks
            << " tracks errs less if it begins with a prior: `sila prior make --out NEW.sila`, then learn the tracks "
               "with --model NEW.sila (docs/train.md)\n";
}

/// The scale of the first tracks of a stream; without one the report on its rows shows why.
WalkingScale scale_of(std::span<const Trajectory> first, const TrackStream& stream) {
  try {
    return walking_scale(first);
  } catch (const std::invalid_argument&) {
    tell(stream.report());
    throw;
  }
}

/// The configuration with the scale of a model in pixels: that of a new one is measured on the first tracks.
Config in_units(const LearnOptions& options, Config config, const StoredModel& stored) {
  if (options.units == "metres" && config.metres_per_pixel > 0.0)
    throw std::invalid_argument("learn: --units = metres, but " + options.model +
                                " was learnt in pixels; name another model");
  if (options.units != "pixels") return config;
  const TrackOptions& input = options.tracks;
  if (!input.camera.empty() || !input.scene.empty() || input.read.metres_per_unit)
    throw UsageError("learn: --units pixels is for tracks without --camera, --metres-per-unit and --scene");
  if (config.metres_per_pixel > 0.0) return config;
  if (!stored.model.empty())
    throw std::invalid_argument("learn: --units = pixels, but " + options.model +
                                " was learnt in metres; name another model");
  config.metres_per_pixel = kTrialMetresPerPixel;
  TrackStream stream = open_tracks(input, config).stream;
  std::vector<Trajectory> first;
  while (auto part = stream.next()) {
    std::ranges::move(part->trajectories, std::back_inserter(first));
    if (first.size() >= kScaleTracks) break;
  }
  first.resize(std::min(first.size(), kScaleTracks));
  const WalkingScale scale = scale_of(first, stream);
  config.metres_per_pixel = scale.metres_per_pixel;
  std::cerr << "1 pixel = " << std::setprecision(3) << scale.metres_per_pixel << " m, by a walking speed of "
            << kWalkingSpeed_mps << " m/s, measured on " << scale.walking << " of the first " << first.size()
            << " tracks; a camera is more accurate\n";
  return config;
}

void learn_tracks(const LearnOptions& options) {
  if (options.share.empty() != (options.min_people == 0))
    throw UsageError("learn: --min-people and --share belong together");
  if (!options.share.empty()) require_no_records("--share", options.share, true);
  const ThreadLimit limit(options.common.threads);
  ModelFile file = ModelFile::open_or_create(options.model);
  StoredModel stored;
  if (!file.empty()) stored = file.read();
  const Config config = in_units(options, configured(options.common, stored, options.model), stored);
  const int before = last_episode(stored);
  const bool is_new = stored.model.episodes == 0;
  Batches batches(options, config, stored.model);
  const std::string configuration = to_json(config).dump();
  std::optional first = batches.next();
  warn(warnings_before_learning(stored, *first, batches.read_ahead()));
  const auto next = [&] { return first ? *std::exchange(first, std::nullopt) : batches.next(); };
  const Training run =
      run_batches(std::move(stored.model), next, config.episode, sila_update(config.episode),
                  [&](int number, const Model& previous, const Episode& episode) {
                    file.commit(episode.model, record_of(before + number, previous, episode), configuration);
                    print_episode(before + number, episode.report);
                  });
  if (batches.tracks() == 0)
    throw std::invalid_argument("learn: --hold-out holds back all tracks; give a smaller share");
  if (!options.share.empty()) write_k_anonymous(options, run.model, configuration);
  print_result(options, run, batches.tracks());
  if (is_new) recommend_prior(run.model);
}

}  // namespace

void add_learn(CLI::App& app) {
  const auto [verb, options] =
      add_verb(app,
               {"learn", "Learn tracks into a new or an existing model; every batch is an episode.",
                "sila learn tracks.csv --scene corner.json --model corner.sila --batch 20"},
               Shared::both, learn_tracks);
  add_tracks(*verb, options->tracks);
  add_hold_out(*verb, options->tracks);
  verb->add_option("--model", options->model, "model file to create or to update")->required()->type_name("M.sila");
  verb->add_option("--batch", options->batch, "tracks per episode [20]")->check(CLI::Range(1, 1000000));
  verb->add_option(
          "--units", options->units,
          "unit of the tracks: metres, or pixels without a camera, whose scale is estimated by the walking speed "
          "and kept in the model [metres, or that of the model]")
      ->check(CLI::IsMember({"metres", "pixels"}))
      ->type_name("UNIT");
  verb->add_option("--min-people", options->min_people,
                   "least number of different tracks that showed each part of --share")
      ->check(CLI::Range(1, 1000000000));
  verb->add_option("--share", options->share,
                   "also write a k-anonymous copy of the model to this file; needs --min-people")
      ->type_name("S.sila");
}

}  // namespace sila::cli
