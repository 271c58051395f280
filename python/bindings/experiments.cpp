#include "experiments.hpp"

#include <cstdio>
#include <numeric>
#include <random>
#include <ranges>

#include "arrays.hpp"
#include "sila/core/sampling.hpp"
#include "sila/evaluate/training_support.hpp"
#include "sila/io/reports.hpp"

// Computations of the experiments in Python: splits, windows, the library's own methods, scores.
namespace sila::python {
namespace {

using Doubles = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

/// The tracks of several scenes as of one site; ids are a scene's own, so each gets the name of its scene in front.
FramedTracks joined(const std::vector<std::pair<std::string, FramedTracks>>& scenes) {
  FramedTracks all;
  for (const auto& [name, some] : scenes) {
    std::size_t recordings = 0;
    for (const FramedTrajectory& placed : all.tracks) recordings = std::max(recordings, placed.track.recording + 1);
    for (FramedTrajectory placed : some.tracks) {
      placed.track.recording += recordings;
      placed.track.id = name + ":" + placed.track.id;
      all.tracks.push_back(std::move(placed));
    }
  }
  return all;
}

SplitBy split_named(const std::string& by) {
  return value_named<SplitBy>("split: by", kSplitBy, by);
}

std::pair<FramedTracks, FramedTracks> both_sides(Split split) {
  return {FramedTracks{std::move(split.train)}, FramedTracks{std::move(split.test)}};
}

FramedTracks taken(const FramedTracks& of, const std::vector<std::size_t>& indices) {
  FramedTracks some;
  for (const std::size_t i : indices) some.tracks.push_back(of.tracks.at(i));
  return some;
}

FramedTracks rescaled_for(FramedTracks framed, const std::string& config_json) {
  const CurbScaling scaling = config_of(config_json).episode.scaling;
  for (FramedTrajectory& placed : framed.tracks) placed.frame = rescaled(placed.frame, scaling);
  return framed;
}

/// In the frame that a model without a scene makes of its first batch.
FramedTracks without_scene(FramedTracks framed, const FramedTracks& first_batch, const std::string& config_json) {
  const Config config = config_of(config_json);
  place(framed.tracks, scene_for({}, {}, first_batch.tracks, config.corners), config.corners, config.episode.scaling);
  return framed;
}

/// The same paths in less time: everybody is `speed` times as fast.
FramedTracks played(FramedTracks framed, double speed) {
  for (FramedTrajectory& placed : framed.tracks) {
    for (double& time_s : placed.track.times_s) time_s /= speed;
  }
  return framed;
}

/// FNV-1a over all that a track is, as 16 hexadecimal digits.
std::string hash_of(const FramedTracks& framed) {
  std::uint64_t hash = 14695981039346656037ull;
  const auto add = [&](const void* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 1099511628211ull;
  };
  for (const auto& [track, frame] : framed.tracks) {
    add(track.id.data(), track.id.size());
    add("\n", 1);
    add(&track.recording, sizeof track.recording);
    add(track.times_s.data(), sizeof(double) * track.times_s.size());
    for (const Vector2& p : track.positions_m) add(p.data(), 2 * sizeof(double));
    for (const Vector2& v : {frame.origin_m, frame.axis_1, frame.axis_2, frame.unit_m})
      add(v.data(), 2 * sizeof(double));
  }
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

/// `present`: the people among whom there may be companions; null: those of `framed`.
WindowSet windows_in(const FramedTracks& framed, const std::string& config_json, double stride_s,
                     const FramedTracks* present) {
  const Config config = config_of(config_json);
  const auto& [sampling, predict] = std::pair(config.episode.sampling, config.episode.predict);
  WindowSet set{{}, sampling.interval_s, static_cast<std::size_t>(steps_in(predict.horizon_s, sampling.interval_s))};
  const PresentPeople people(present != nullptr ? present->tracks : framed.tracks);
  for (Window& window :
       windows_of(framed.tracks, sampling, predict, stride_s, std::span(&config.evaluate.observed_s, 1), &people)) {
    if (window.future_m.size() == set.steps) set.windows.push_back(std::move(window));
  }
  return set;
}

WindowSet without_future(WindowSet set) {
  for (Window& window : set.windows) window.future_m.clear();
  return set;
}

/// Gives each track a recording of its own. People of other recordings are no companions, so nobody has any.
FramedTracks without_companions(FramedTracks framed) {
  for (std::size_t i = 0; i < framed.tracks.size(); ++i) framed.tracks[i].track.recording = i;
  return framed;
}

WindowSet without_companions(WindowSet set) {
  for (Window& window : set.windows) window.observed.companions_mps.setZero();
  return set;
}

/// Positions (n, 2) [m] and velocities (n, 2) [m/s] of the resampled tracks, as at the site of `frame`.
nb::tuple samples_of(const FramedTracks& framed, const std::string& config_json, const CurbFrame& frame) {
  const SamplingConfig sampling = config_of(config_json).episode.sampling;
  std::vector<Vector2> positions, velocities;
  for (const FramedTrajectory& placed : framed.tracks) {
    const CurbTrajectory track = resample(placed.track, placed.frame, sampling);
    for (const Vector2& p : track.positions) positions.push_back(to_world(frame, p));
    for (const Vector2& v : track.velocities) velocities.push_back(velocity_to_world(frame, v));
  }
  return nb::make_tuple(array_of_points(positions), array_of_points(velocities));
}

/// One path a window, all of one length, as (windows, length, 2); none has the length 0.
template <class PathOf>
auto stacked(const WindowSet& set, PathOf&& path_of) {
  std::vector<double> numbers;
  std::size_t length = 0;
  for (const Window& window : set.windows) {
    const auto& path = std::invoke(path_of, window);
    length = path.size();
    for (const Vector2& point : path) numbers.insert(numbers.end(), {point.x(), point.y()});
  }
  return array_of(std::move(numbers), {set.windows.size(), length, 2});
}

/// Smoothed positions [m] and velocities [m/s] that were observed and the future [m], all as at the site of `frame`.
nb::tuple laid_over(const WindowSet& set, const CurbFrame& frame) {
  const auto positions_m = [&](const Window& window) {
    return std::views::transform(window.observed.positions, [&](const Vector2& p) { return to_world(frame, p); });
  };
  const auto velocities_mps = [&](const Window& window) {
    return std::views::transform(window.observed.velocities,
                                 [&](const Vector2& v) { return velocity_to_world(frame, v); });
  };
  const auto future_m = [&](const Window& window) {
    return std::views::transform(window.future_m,
                                 [&](const Vector2& p) { return to_world(frame, to_curb(window.observed.frame, p)); });
  };
  return nb::make_tuple(stacked(set, positions_m), stacked(set, velocities_mps), stacked(set, future_m));
}

void require_shape(const char* what, const Doubles& array, std::initializer_list<std::size_t> shape) {
  bool fits = array.ndim() == shape.size();
  for (std::size_t d = 0; fits && d < shape.size(); ++d) fits = array.shape(d) == shape.begin()[d];
  if (!fits) throw std::invalid_argument(std::string("predictions: ") + what + " is not of the expected shape");
}

/// Modes of a positive weight, heaviest first.
std::vector<Mode> modes_of(const double* weights, const double* paths, const double* covariances, std::size_t modes,
                           std::size_t steps) {
  std::vector<Mode> found;
  for (std::size_t k = 0; k < modes; ++k) {
    if (!(weights[k] > 0.0)) continue;
    Mode mode{weights[k], {}, {}, {}};
    for (std::size_t i = k * steps; i < (k + 1) * steps; ++i) {
      mode.path_m.emplace_back(paths[2 * i], paths[2 * i + 1]);
      mode.covariances_m2.push_back(Eigen::Map<const Matrix2>(covariances + 4 * i));
    }
    found.push_back(std::move(mode));
  }
  std::ranges::stable_sort(found, std::ranges::greater{}, &Mode::weight);
  return found;
}

/// Paths (n, k, t, 2) at the site of `frame` as at the site of each window [m].
auto laid_back(const WindowSet& set, const Doubles& paths_m, const CurbFrame& frame) {
  const std::size_t modes = paths_m.ndim() == 4 ? paths_m.shape(1) : 0;
  const std::size_t steps = paths_m.ndim() == 4 ? paths_m.shape(2) : 0;
  require_shape("paths_m", paths_m, {set.windows.size(), modes, steps, 2});
  std::vector<double> numbers;
  numbers.reserve(paths_m.size());
  for (std::size_t i = 0; i + 1 < paths_m.size(); i += 2) {
    const CurbFrame& own = set.windows[i / (2 * modes * steps)].observed.frame;
    const Vector2 p = to_world(own, to_curb(frame, {paths_m.data()[i], paths_m.data()[i + 1]}));
    numbers.insert(numbers.end(), {p.x(), p.y()});
  }
  return array_of(std::move(numbers), {set.windows.size(), modes, steps, 2});
}

/// weights (n, k), paths_m (n, k, t, 2), covariances_m2 (n, k, t, 2, 2).
std::vector<TrackPrediction> predictions_of(const WindowSet& set, const Doubles& weights, const Doubles& paths_m,
                                            const Doubles& covariances_m2, bool fallback) {
  const std::size_t count = set.windows.size(), modes = weights.ndim() == 2 ? weights.shape(1) : 0;
  require_shape("weights", weights, {count, modes});
  require_shape("paths_m", paths_m, {count, modes, set.steps, 2});
  require_shape("covariances_m2", covariances_m2, {count, modes, set.steps, 2, 2});
  std::vector<TrackPrediction> predictions;
  for (std::size_t n = 0; n < count; ++n) {
    const CurbTrajectory& observed = set.windows[n].observed;
    Prediction prediction{observed.times_s.back(), {}, {}, {}, fallback, fallback ? 1.0 : 0.0};
    for (std::size_t t = 1; t <= set.steps; ++t) prediction.times_s.push_back(static_cast<double>(t) * set.interval_s);
    prediction.modes = modes_of(weights.data() + n * modes, paths_m.data() + n * modes * set.steps * 2,
                                covariances_m2.data() + n * modes * set.steps * 4, modes, set.steps);
    if (prediction.modes.empty())
      throw std::invalid_argument("predictions_of: a window has no mode of positive weight");
    predictions.push_back({observed.id, observed.id, std::move(prediction)});
  }
  return predictions;
}

nlohmann::ordered_json to_json(const WindowScore& window) {
  nlohmann::ordered_json json{{"track", window.track},     {"t0_s", window.t0_s},     {"moving", window.moving},
                              {"turning", window.turning}, {"inside", window.inside}, {"fallback", window.fallback},
                              {"novelty", window.novelty}, {"modes", window.modes}};
  json["fork"] = window.way_log_probability.has_value();
  json["way_log_probability"] = window.way_log_probability.value_or(0.0);
  json["standing"] = window.motion_state == kStanding;
  json["changes"] = nlohmann::ordered_json::array();
  for (const ChangeForecast& forecast : window.changes)
    json["changes"].push_back({forecast.probability, forecast.changed});
  json["model"] = sila::to_json(window.model.back());
  for (std::size_t r = 0; r < window.references.size(); ++r) json[kReferences[r]] = sila::to_json(window.references[r]);
  return json;
}

/// The evaluation, and every window by itself, as JSON.
std::pair<std::string, std::string> scores_of(const std::vector<TrackPrediction>& predictions, const FramedTracks& test,
                                              const TrainingSupport& support, const std::string& config_json) {
  std::map<std::pair<std::string, double>, const Prediction*> by_window;
  for (const TrackPrediction& p : predictions) by_window[{p.tracklet, p.content.t0_s}] = &p.content;
  const Forecast forecast = [&](const CurbTrajectory& observed) {
    const auto found = by_window.find({observed.id, observed.times_s.back()});
    return found == by_window.end() ? Prediction{} : *found->second;
  };
  const Config config = config_of(config_json);
  const Evaluation evaluation = evaluate_forecast(forecast, test.tracks, config.episode, config.evaluate, &support);
  return {sila::to_json(evaluation).dump(), windows_json(evaluation)};
}

/// Orders of `sites` things as indices, the listed one first; 0 of `orders` means every order, at most 5040.
std::vector<std::vector<std::size_t>> orders_of(std::size_t sites, std::size_t orders, std::uint64_t seed) {
  std::vector<std::size_t> order(sites);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<std::vector<std::size_t>> all;
  do all.push_back(order);
  while (all.size() < 5040 && std::ranges::next_permutation(order).found);
  std::mt19937_64 random(seed);
  for (std::size_t i = all.size(); orders > 0 && i > 2; --i) std::swap(all[i - 1], all[1 + random() % (i - 1)]);
  if (orders > 0) all.resize(std::min(all.size(), orders));
  return all;
}

void bind_framed_tracks(nb::module_& module) {
  nb::class_<FramedTracks>(module, "FramedTracks", "Tracks with the frame of their corner, ready to be learnt.")
      .def(
          "__init__",
          [](FramedTracks* self, const std::vector<Track>& tracks, const DrawnScene& scene, const std::string& config) {
            new (self) FramedTracks{placed(tracks, scene, config_of(config))};
          },
          "tracks"_a, "scene"_a, "config"_a)
      .def_static(
          "simulated", [](const std::string& config) { return FramedTracks{simulated_tracks(config_of(config))}; },
          "config"_a, "Simulated tracks, cleaned as those of a tracker.")
      .def_static("joined", &joined, "scenes"_a)
      .def("__len__", [](const FramedTracks& f) { return f.tracks.size(); })
      .def_prop_ro("ids",
                   [](const FramedTracks& f) {
                     return list_of(f.tracks, [](const FramedTrajectory& placed) { return placed.track.id; });
                   })
      .def_prop_ro("durations_s",
                   [](const FramedTracks& f) {
                     return list_of(f.tracks, [](const FramedTrajectory& placed) {
                       return placed.track.times_s.back() - placed.track.times_s.front();
                     });
                   })
      .def_prop_ro(
          "recordings",
          [](const FramedTracks& f) {
            return list_of(f.tracks, [](const FramedTrajectory& placed) { return placed.track.recording; });
          },
          "Number of the recording of each track: only those of one recording have a common clock.")
      .def_prop_ro("hash", &hash_of)
      .def(
          "frame", [](const FramedTracks& f, std::size_t i) { return f.tracks.at(i).frame; }, "index"_a)
      .def("take", &taken, "indices"_a)
      .def("without_companions", nb::overload_cast<FramedTracks>(&without_companions),
           "Each track in a recording of its own, so that nobody has companions.")
      .def("rescaled", &rescaled_for, "config"_a, "In the curb units of a configuration.")
      .def("without_scene", &without_scene, "first_batch"_a, "config"_a,
           "In the frame that a model without a scene makes of its first batch.")
      .def("played", &played, "speed"_a, "The same paths in less time: everybody is `speed` times as fast.")
      .def(
          "split",
          [](const FramedTracks& f, double share, std::uint64_t seed, const std::string& by) {
            return both_sides(split_tracks(f.tracks, share, seed, split_named(by)));
          },
          "test_share"_a, "seed"_a, "by"_a)
      .def(
          "split_people",
          [](const FramedTracks& f, std::size_t people, std::uint64_t seed, const std::string& by) {
            return both_sides(split_people(f.tracks, people, seed, split_named(by)));
          },
          "test_people"_a, "seed"_a, "by"_a)
      .def("samples", &samples_of, "config"_a, "frame"_a,
           "Positions and velocities of the resampled tracks, as at the site of a frame.")
      .def("windows", &windows_in, "config"_a, "stride_s"_a, "present"_a.none() = nb::none());
}

void bind_window_set(nb::module_& module) {
  nb::class_<WindowSet>(module, "WindowSet", "Windows of tracks: the observed part until t0, and the future after it.")
      .def("__len__", [](const WindowSet& set) { return set.windows.size(); })
      .def_ro("interval_s", &WindowSet::interval_s, "Seconds between two steps.")
      .def_ro("steps", &WindowSet::steps, "Steps to predict.")
      .def_prop_ro("track_ids",
                   [](const WindowSet& set) {
                     return list_of(set.windows, [](const Window& window) { return window.observed.id; });
                   })
      .def_prop_ro("t0_s",
                   [](const WindowSet& set) {
                     return list_of(set.windows, [](const Window& window) { return window.observed.times_s.back(); });
                   })
      .def_prop_ro(
          "past_m", [](const WindowSet& set) { return stacked(set, &Window::past_m); }, nb::rv_policy::automatic,
          "Shape (n, p, 2), metres: raw positions until t0, `interval_s` apart.")
      .def_prop_ro(
          "future_m", [](const WindowSet& set) { return stacked(set, &Window::future_m); }, nb::rv_policy::automatic,
          "Shape (n, steps, 2), metres: raw positions after t0; (n, 0, 2) where it is hidden.")
      .def("without_future", &without_future)
      .def("without_companions", nb::overload_cast<WindowSet>(&without_companions))
      .def("laid_back", &laid_back, "paths_m"_a, "frame"_a,
           "Paths (n, k, t, 2) at the site of a frame as at the site of each window.")
      .def("laid_over", &laid_over, "frame"_a,
           "Smoothed positions and velocities observed, and the future, as at the site of a frame.");
}

}  // namespace

std::string windows_json(const Evaluation& evaluation) {
  nlohmann::ordered_json windows = nlohmann::ordered_json::array();
  for (const WindowScore& window : evaluation.windows) windows.push_back(to_json(window));
  return windows.dump();
}

void bind_experiments(nb::module_& module) {
  bind_framed_tracks(module);
  bind_window_set(module);
  bind_model_learner(module);
  nb::class_<TrainingSupport>(
      module, "TrainingSupport",
      "Results of the training tracks that scoring uses: the covered area, fitted references, passages.")
      .def(
          "__init__",
          [](TrainingSupport* self, const FramedTracks& train, const std::string& config_json) {
            const Config config = config_of(config_json);
            new (self) TrainingSupport(training_support(train.tracks, config.episode, config.evaluate));
          },
          "train"_a, "config"_a);
  module.def("predictions_of", &predictions_of, "windows"_a, "weights"_a, "paths_m"_a, "covariances_m2"_a,
             "fallback"_a);
  module.def("scores_of", &scores_of, "predictions"_a, "test"_a, "support"_a, "config"_a,
             nb::call_guard<nb::gil_scoped_release>());
  module.def("person_of", &person_of, "track_id"_a, "The person of a track: tracklets of one are 17, 17#2, ...");
  module.def("orders_of", &orders_of, "sites"_a, "orders"_a, "seed"_a);
  module.def(
      "limit_threads",
      [](int threads) {
        static std::optional<ThreadLimit> limit;
        limit.reset();
        limit.emplace(threads);
      },
      "threads"_a, "Of everything that is computed from now on; 0: no limit.");
}

}  // namespace sila::python
