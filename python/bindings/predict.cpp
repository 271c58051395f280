#include <tbb/parallel_for.h>

#include "arrays.hpp"
#include "sila/core/companions.hpp"
#include "sila/core/sampling.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"
#include "sila/refine/outcomes.hpp"
#include "sila/refine/predictor.hpp"

namespace sila::python {
namespace {

/// A model and all tracks that it predicts: each of them may be a companion of each.
struct TracksPredictor {
  Config config;
  Predictor predictor;
  std::vector<Track> tracks;
  std::vector<FramedTrajectory> framed;
  PresentPeople present;

  TracksPredictor(const StoredModel& stored, const std::string& config_json, std::vector<Track> all,
                  const DrawnScene& scene)
      : config(config_of(config_json)),
        predictor(stored.model, config.episode.predict),
        tracks(std::move(all)),
        framed(placed(tracks, scene, config)),
        present(framed) {}
};

/// What `of_window` makes of each moment that is due, in the order of the tracks, `count` of them from `first` on: as
/// `sila predict`, or only from the last sample of each track.
template <class Value, class OfWindow>
std::vector<Value> at_due_moments(const TracksPredictor& made, std::size_t first, std::size_t count, double stride_s,
                                  bool at_end, int threads, OfWindow&& of_window) {
  if (!(stride_s > 0.0))
    throw std::invalid_argument("predict: stride_s = " + std::to_string(stride_s) + ", must be positive");
  const ThreadLimit limit(threads);
  const EpisodeConfig& config = made.config.episode;
  std::vector<std::vector<Value>> of_track(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    const auto& [track, frame] = made.framed.at(first + i);
    const std::vector<std::size_t> due = at_end ? std::vector{track.times_s.size() - 1}
                                                : prediction_samples(track, config.predict.min_observe_s, stride_s);
    for (const std::size_t last : due) {
      of_track[i].push_back(of_window(
          made.tracks[first + i], made.present.observe(track, last, frame, config.predict.observe_s, config.sampling)));
    }
  });
  std::vector<Value> all;
  for (auto& some : of_track) std::move(some.begin(), some.end(), std::back_inserter(all));
  return all;
}

std::vector<TrackPrediction> predict_tracks(const TracksPredictor& made, std::size_t first, std::size_t count,
                                            double stride_s, bool at_end, int threads) {
  return at_due_moments<TrackPrediction>(
      made, first, count, stride_s, at_end, threads, [&](const Track& track, const CurbTrajectory& observed) {
        return TrackPrediction{track.input_id, track.trajectory.id, made.predictor.predict(observed),
                               made.config.metres_per_pixel};
      });
}

/// The lines of `sila predict --explain`, every number in full.
std::vector<std::string> explain_tracks(const TracksPredictor& made, double stride_s, bool at_end, int threads) {
  return at_due_moments<std::string>(
      made, 0, made.tracks.size(), stride_s, at_end, threads, [&](const Track& track, const CurbTrajectory& observed) {
        const Explanation explanation = explain(made.predictor, observed);
        const auto camera = pixel_camera(made.config);
        return prediction_line(track.input_id, made.predictor.predict(observed), &explanation,
                               camera ? &*camera : nullptr, {.digits = 17});
      });
}

/// How surprising a path is, point by point.
auto scores(const TrackPrediction& prediction, nb::handle given) {
  const std::vector<Vector2> path = finite_points_from("path_m", given);
  if (path.size() > prediction.content.times_s.size()) {
    throw std::invalid_argument("path_m: expected at most " + std::to_string(prediction.content.times_s.size()) +
                                " points, found " + std::to_string(path.size()));
  }
  std::vector<double> found;
  for (std::size_t step = 0; step < path.size(); ++step)
    found.push_back(nonconformity(prediction.content, step, path[step]));
  return array_of(std::move(found), {path.size()});
}

/// Times and, of each outcome, probabilities; empty without a heading.
std::map<std::string, std::vector<double>> outcomes_of(const Prediction& prediction) {
  std::map<std::string, std::vector<double>> lists;
  if (prediction.heading.isZero()) return lists;
  for (const std::size_t step : outcome_steps(prediction)) {
    const OutcomeProbabilities probabilities = outcome_probabilities(prediction, step);
    lists["within_s"].push_back(prediction.times_s[step]);
    for (std::size_t k = 0; k < kOutcomeCount; ++k) lists[kOutcomes[k]].push_back(probabilities[k]);
  }
  return lists;
}

auto covariances_of(const Mode& mode) {
  std::vector<double> numbers;
  append(numbers, mode.covariances_m2);
  return array_of(std::move(numbers), {mode.covariances_m2.size(), 2, 2});
}

auto all_paths(const Prediction& prediction) {
  std::vector<double> numbers;
  for (const Mode& mode : prediction.modes) append(numbers, mode.path_m);
  return array_of(std::move(numbers), {prediction.modes.size(), prediction.times_s.size(), 2});
}

auto paths_in_image(const TrackPrediction& prediction) {
  if (prediction.metres_per_pixel == 0.0)
    throw std::invalid_argument("paths_px: the model is in metres; see Stream.to_image for a camera");
  const Camera camera = flat_camera(prediction.metres_per_pixel);
  TrackPrediction in_image = prediction;
  for (Mode& mode : in_image.content.modes) {
    for (Vector2& point : mode.path_m) point = to_image(camera, point).value();
  }
  return all_paths(in_image.content);
}

auto all_covariances(const Prediction& prediction) {
  std::vector<double> numbers;
  for (const Mode& mode : prediction.modes) append(numbers, mode.covariances_m2);
  return array_of(std::move(numbers), {prediction.modes.size(), prediction.times_s.size(), 2, 2});
}

auto all_weights(const Prediction& prediction) {
  return array_of(list_of(prediction.modes, &Mode::weight), {prediction.modes.size()});
}

using ModeState =
    std::tuple<double, std::vector<double>, std::vector<double>, std::vector<int>, int, std::vector<std::size_t>>;
using RegionState = std::pair<double, std::vector<double>>;
/// The position at t0, the heading, and whether the site is mirrored.
using PoseState = std::tuple<double, double, double, double, bool>;
using PredictionState =
    std::tuple<std::string, std::string, double, std::vector<double>, bool, double, double, std::vector<ModeState>,
               std::vector<RegionState>, bool, std::vector<double>, double, PoseState>;

std::vector<RegionState> regions_of(const Prediction& prediction) {
  return list_of(prediction.regions,
                 [](const Region& region) { return RegionState(region.probability, region.levels); });
}

PredictionState state_of(const TrackPrediction& prediction) {
  std::vector<ModeState> modes;
  for (const Mode& mode : prediction.content.modes) {
    std::vector<double> path, covariances;
    append(path, mode.path_m);
    append(covariances, mode.covariances_m2);
    modes.push_back({mode.weight, std::move(path), std::move(covariances), mode.primitives,
                     static_cast<int>(mode.variant), mode.sources});
  }
  const Prediction& content = prediction.content;
  const PoseState pose(content.start_m.x(), content.start_m.y(), content.heading.x(), content.heading.y(),
                       content.mirrored);
  return PredictionState(prediction.track, prediction.tracklet, content.t0_s, content.times_s, content.fallback,
                         content.novelty, content.observed_s, modes, regions_of(content), content.standing,
                         content.change_probabilities, prediction.metres_per_pixel, pose);
}

TrackPrediction prediction_in(const PredictionState& state) {
  const auto& [track, tracklet, t0_s, times_s, fallback, novelty, observed_s, modes, regions, standing, changes, scale,
               pose] = state;
  TrackPrediction prediction{
      track, tracklet, {t0_s, times_s, {}, {}, fallback, novelty, observed_s, standing, changes}, scale};
  prediction.content.start_m = {std::get<0>(pose), std::get<1>(pose)};
  prediction.content.heading = {std::get<2>(pose), std::get<3>(pose)};
  prediction.content.mirrored = std::get<4>(pose);
  for (const auto& [probability, levels] : regions) prediction.content.regions.push_back({probability, levels});
  for (const auto& [weight, path, covariances, primitives, variant, sources] : modes) {
    Mode mode{weight, {}, {}, primitives, static_cast<VariantKind>(variant), sources};
    for (std::size_t i = 0; i + 1 < path.size(); i += 2) mode.path_m.emplace_back(path[i], path[i + 1]);
    for (std::size_t i = 0; i + 3 < covariances.size(); i += 4) {
      Matrix2 matrix;
      matrix << covariances[i], covariances[i + 1], covariances[i + 2], covariances[i + 3];
      mode.covariances_m2.push_back(matrix);
    }
    prediction.content.modes.push_back(std::move(mode));
  }
  return prediction;
}

void bind_mode(nb::module_& module) {
  nb::class_<Mode>(module, "Mode", "One hypothesis of the future path of the person, in the world frame.")
      .def_ro("weight", &Mode::weight, "In [0, 1]; the weights of a prediction have the sum 1.")
      .def_prop_ro(
          "path_m", [](const Mode& mode) { return view_of(mode.path_m); }, nb::rv_policy::reference_internal,
          "Shape (t, 2), metres: the mean position at each time of the prediction.")
      .def_prop_ro("covariances_m2", &covariances_of, nb::rv_policy::automatic,
                   "Shape (t, 2, 2), square metres: of the position.")
      .def_ro("primitives", &Mode::primitives, "Visited, in order; empty for constant velocity.")
      .def_prop_ro(
          "variant", [](const Mode& mode) { return kVariantKinds[static_cast<std::size_t>(mode.variant)]; },
          "expected, or how it differs: slower, faster, left, right; wide: the same path, larger covariances.")
      .def("__repr__", [](const Mode& mode) {
        return nb::str("Mode(weight={:.3f}, {} steps, primitives={})")
            .format(mode.weight, mode.path_m.size(), mode.primitives);
      });
}

void bind_prediction(nb::module_& module) {
  nb::class_<TrackPrediction>(module, "Prediction",
                              "The next seconds of one person as m weighted modes over t times, heaviest first.")
      .def_ro("track", &TrackPrediction::track, "The id that the rows of the track had in the input.")
      .def_ro("tracklet", &TrackPrediction::tracklet,
              "The unique id of the track, \"17#2\" for a later tracklet of 17.")
      .def_prop_ro(
          "t0_s", [](const TrackPrediction& p) { return p.content.t0_s; },
          "Time of the last observed sample, on the clock of the input.")
      .def_prop_ro(
          "times_s", [](const TrackPrediction& p) { return view_of(p.content.times_s); },
          nb::rv_policy::reference_internal, "Shape (t,), seconds after t0.")
      .def_prop_ro(
          "fallback", [](const TrackPrediction& p) { return p.content.fallback; },
          "No roll-outs: no transition matched, or nothing was learnt at this corner.")
      .def_prop_ro(
          "novelty", [](const TrackPrediction& p) { return p.content.novelty; },
          "In [0, 1]: share of the people learnt so far whose path was better known than this one.")
      .def_prop_ro(
          "observed_s", [](const TrackPrediction& p) { return p.content.observed_s; },
          "Seconds between the first and the last sample that it rests on.")
      .def_prop_ro(
          "standing", [](const TrackPrediction& p) { return p.content.standing; },
          "Whether the mean speed while observed was below 0.3 m/s, or the net speed below 0.17 m/s.")
      .def_prop_ro(
          "change_probabilities", [](const TrackPrediction& p) { return view_of(p.content.change_probabilities); },
          nb::rv_policy::reference_internal,
          "Shape (t,): that the person has changed their motion by each time: one who stands has started (is 0.5 m "
          "away), one who walks has stopped (slower than 0.3 m/s over 0.8 s). Shape (0,) before errors are known.")
      .def_prop_ro(
          "position_m", [](const TrackPrediction& p) { return array_of_pair(p.content.start_m); },
          nb::rv_policy::automatic, "Shape (2,): where the person was at t0, as it was estimated, metres.")
      .def_prop_ro(
          "heading", [](const TrackPrediction& p) { return array_of_pair(p.content.heading); },
          nb::rv_policy::automatic,
          "Shape (2,): unit vector of the last 0.8 s; of a person who stands axis 1 of the site; zero if not known.")
      .def_prop_ro(
          "outcomes", [](const TrackPrediction& p) { return outcomes_of(p.content); },
          "Where the person will be: lists of within_s (whole seconds and the horizon) and of the probabilities stays, "
          "straight, left, right and back then, relative to position_m and heading.")
      .def_prop_ro(
          "regions", [](const TrackPrediction& p) { return regions_of(p.content); },
          "(probability, levels of shape (t,)): with that probability the person will be where the density of the "
          "modes is at least exp(-level) of its peak; none from a model that no error has fitted yet.")
      .def(
          "nonconformity_scores", &scores, "path_m"_a, nb::rv_policy::automatic,
          nb::sig(
              "def nonconformity_scores(self, path_m: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"),
          "path_m: (n, 2), n at most t, metres, at the times of the prediction. Shape (n,): log(peak / density) there; "
          "a point lies in a region where that is at most the region's level. Raises ValueError for other shapes or "
          "NaN.")
      .def_prop_ro(
          "modes", [](const TrackPrediction& p) { return p.content.modes; }, "A list of m Mode, heaviest first.")
      .def_prop_ro(
          "weights", [](const TrackPrediction& p) { return all_weights(p.content); }, nb::rv_policy::automatic,
          "Shape (m,); their sum is 1.")
      .def_prop_ro(
          "nearest_probabilities",
          [](const TrackPrediction& p) { return array_of(nearest_probabilities(p.content), {p.content.modes.size()}); },
          nb::rv_policy::automatic,
          "Shape (m,): that no other path comes nearer to the way that the person takes; 0 for a mode whose path an "
          "earlier mode has. Their sum is 1.")
      .def_prop_ro(
          "paths_m", [](const TrackPrediction& p) { return all_paths(p.content); }, nb::rv_policy::automatic,
          "Shape (m, t, 2), metres.")
      .def_ro("metres_per_pixel", &TrackPrediction::metres_per_pixel, "Of a model in pixels; 0 for one in metres.")
      .def_prop_ro("paths_px", &paths_in_image, nb::rv_policy::automatic,
                   nb::for_getter(nb::sig("def paths_px(self, /) -> numpy.typing.NDArray[numpy.float64]")),
                   "Shape (m, t, 2), pixels, v downwards. Raises ValueError for a model that is not in pixels.")
      .def_prop_ro(
          "covariances_m2", [](const TrackPrediction& p) { return all_covariances(p.content); },
          nb::rv_policy::automatic, "Shape (m, t, 2, 2), square metres.")
      .def(
          "to_json",
          [](const TrackPrediction& p, int digits, bool outcomes) {
            const Camera camera = flat_camera(p.metres_per_pixel > 0.0 ? p.metres_per_pixel : 1.0);
            return prediction_line(p.track, p.content, nullptr, p.metres_per_pixel > 0.0 ? &camera : nullptr,
                                   {.digits = digits, .outcomes = outcomes});
          },
          "digits"_a = LineFormat{}.digits, "outcomes"_a = false,
          "The line that `sila predict --digits` writes, 17: every number in full; with outcomes as by `--outcomes`.")
      .def(
          "to_frame", [](nb::handle p) { return nb::module_::import_("sila._predictions").attr("frame_of")(p); },
          nb::sig("def to_frame(self) -> pandas.DataFrame"),
          "One row a mode and time: track_id, t0, fallback, novelty, mode, weight, variant, t, x, y, cov_xx, cov_xy, "
          "cov_yy.")
      .def("__eq__", [](const TrackPrediction& a, const TrackPrediction& b) { return state_of(a) == state_of(b); })
      .def(
          "__eq__", [](const TrackPrediction&, nb::handle) { return false; }, nb::arg().none())
      .def("__repr__",
           [](const TrackPrediction& p) {
             return nb::str("Prediction(track='{}', t0_s={:g}, {} modes, {} steps{})")
                 .format(p.track, p.content.t0_s, p.content.modes.size(), p.content.times_s.size(),
                         p.content.fallback ? ", fallback" : "");
           })
      .def("__getstate__", &state_of)
      .def("__setstate__",
           [](TrackPrediction& p, const PredictionState& state) { new (&p) TrackPrediction(prediction_in(state)); });
}

}  // namespace

void bind_predict(nb::module_& module) {
  bind_mode(module);
  bind_prediction(module);
  nb::class_<TracksPredictor>(module, "ReadyPredictor", "A model, and the tracks that it is to predict.")
      .def(nb::init<const StoredModel&, const std::string&, std::vector<Track>, const DrawnScene&>(), "model"_a,
           "config"_a, "tracks"_a, "scene"_a, nb::call_guard<nb::gil_scoped_release>())
      .def("explain", &explain_tracks, "stride_s"_a, "at_end"_a, "threads"_a, nb::call_guard<nb::gil_scoped_release>())
      .def("predict", &predict_tracks, "first"_a, "count"_a, "stride_s"_a, "at_end"_a, "threads"_a,
           nb::call_guard<nb::gil_scoped_release>());
}

}  // namespace sila::python
