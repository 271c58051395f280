#include "sila/report/report.hpp"

#include <zlib.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "core/indices.hpp"
#include "embedded_predictor.hpp"
#include "encode.hpp"
#include "io/json_file.hpp"
#include "io/portable_predictor.hpp"
#include "report/model_data.hpp"
#include "report/scored.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/version.hpp"

namespace sila {
namespace {

using detail::path_json;
using detail::rounded;
using nlohmann::ordered_json;

/// The worst prediction of each track, the worst track first.
std::vector<std::size_t> worst_of(std::span<const ScoredPrediction> scored) {
  std::vector<std::size_t> order = indices(scored.size());
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [&](std::size_t i) { return scored[i].model.weighted_mhd_m; });
  std::set<std::size_t> seen;
  std::erase_if(order, [&](std::size_t i) { return !seen.insert(scored[i].track).second; });
  return order;
}

ordered_json modes_json(const Prediction& prediction, std::size_t stride) {
  ordered_json list = ordered_json::array();
  for (const Mode& mode : prediction.modes) {
    ordered_json covariances = ordered_json::array();
    for (std::size_t j = 0; j < mode.covariances_m2.size(); ++j) {
      if ((mode.covariances_m2.size() - 1 - j) % stride != 0) continue;
      const Matrix2& c = mode.covariances_m2[j];
      for (double entry : {c(0, 0), c(0, 1), c(1, 1)}) covariances.push_back(rounded(entry, 3));
    }
    list.push_back({{"weight", rounded(mode.weight, 3)},
                    {"path", path_json(mode.path_m, stride)},
                    {"cov", std::move(covariances)},
                    {"primitives", mode.primitives}});
  }
  return list;
}

ordered_json prediction_json(const ScoredPrediction& scored, double interval_s, std::size_t stride) {
  const auto steps = scored.truth_m.size();
  ordered_json times = ordered_json::array();
  for (std::size_t j = 0; j < steps; ++j) {
    if ((steps - 1 - j) % stride == 0) times.push_back(rounded(static_cast<double>(j + 1) * interval_s, 3));
  }
  return {{"t0", rounded(scored.prediction.t0_s, 3)},
          {"t", std::move(times)},
          {"fallback", scored.prediction.fallback},
          {"novelty", rounded(scored.prediction.novelty, 3)},
          {"mhd_m", rounded(scored.model.weighted_mhd_m, 3)},
          {"best_mhd_m", rounded(scored.model.best_mhd_m, 3)},
          {"constant_mhd_m", rounded(scored.constant.weighted_mhd_m, 3)},
          {"observed", path_json(scored.observed_m, stride)},
          {"truth", path_json(scored.truth_m, stride)},
          {"constant", path_json(scored.constant_m, stride)},
          {"modes", modes_json(scored.prediction, stride)}};
}

/// The tracks that can be played: the worst, then others, evenly spread; in the order of the input.
std::vector<std::size_t> played_tracks(std::span<const ScoredPrediction> scored, std::span<const std::size_t> worst,
                                       std::size_t most, std::size_t most_worst) {
  std::set<std::size_t> chosen;
  for (std::size_t k = 0; k < std::min({worst.size(), most_worst, most}); ++k) chosen.insert(scored[worst[k]].track);
  const std::size_t n = std::min(worst.size(), most);
  for (std::size_t k = 0; k < n && chosen.size() < most; ++k) chosen.insert(scored[worst[k * worst.size() / n]].track);
  return {chosen.begin(), chosen.end()};
}

ordered_json played_json(const ReportInput& input, std::span<const ScoredPrediction> scored,
                         std::span<const std::size_t> played, std::size_t stride) {
  const double interval_s = input.stored.model.settings.sample_interval_s;
  ordered_json list = ordered_json::array();
  for (const std::size_t track : played) {
    const Trajectory& path = input.tracks[track].track;
    ordered_json entry{{"track", path.id}, {"t", ordered_json::array()}, {"xy", ordered_json::array()}};
    double due_s = path.times_s.front();
    for (std::size_t k = 0; k < path.times_s.size(); ++k) {
      if (path.times_s[k] < due_s - 1e-9) continue;
      entry["t"].push_back(rounded(path.times_s[k], 2));
      entry["xy"].push_back(rounded(path.positions_m[k].x(), 2));
      entry["xy"].push_back(rounded(path.positions_m[k].y(), 2));
      due_s = path.times_s[k] + interval_s;
    }
    entry["predictions"] = ordered_json::array();
    for (const ScoredPrediction& prediction : scored) {
      if (prediction.track == track) entry["predictions"].push_back(prediction_json(prediction, interval_s, stride));
    }
    list.push_back(std::move(entry));
  }
  return list;
}

ordered_json worst_json(const ReportInput& input, std::span<const ScoredPrediction> scored,
                        std::span<const std::size_t> worst, std::size_t most) {
  ordered_json list = ordered_json::array();
  for (std::size_t k = 0; k < std::min(worst.size(), most); ++k) {
    const ScoredPrediction& prediction = scored[worst[k]];
    list.push_back({{"track", input.tracks[prediction.track].track.id},
                    {"t0", rounded(prediction.prediction.t0_s, 3)},
                    {"mhd_m", rounded(prediction.model.weighted_mhd_m, 3)},
                    {"constant_mhd_m", rounded(prediction.constant.weighted_mhd_m, 3)},
                    {"reason", reason_of(prediction, input.stored.model.settings.sample_interval_s)}});
  }
  return list;
}

/// The parts that come from held-back tracks.
void add_scores(ordered_json& data, const ReportInput& input, const ReportLimits& limits) {
  const double horizon_s = input.episode.predict.horizon_s;
  data["drawn_tracks"] = tracks_json(input.tracks, limits.drawn_tracks);
  data["evaluation"] = to_json(evaluate(input.stored.model, input.tracks, input.episode, input.evaluate));
  data["evaluation"]["tracks"] = input.tracks.size();
  data["rows"] = to_json(input.rows);
  const std::vector<ScoredPrediction> scored =
      score_predictions(input.stored.model, input.tracks, input.episode, limits.stride_s);
  const std::vector<std::size_t> worst = worst_of(scored);
  data["predictions_scored"] = scored.size();
  data["tracks_scored"] = worst.size();
  data["horizon_s"] = horizon_s;
  data["calibration"] = reliability_json(scored, horizon_s);
  for (std::size_t most = limits.predicted_tracks;; most /= 2) {
    data["worst"] = worst_json(input, scored, worst, std::min(limits.worst, most));
    data["played"] = played_json(input, scored, played_tracks(scored, worst, most, limits.worst), 2);
    if (most <= 1 || one_line(data).size() <= limits.most_bytes) return;
  }
}

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_COMPRESSION);
  if (status != Z_OK) throw std::runtime_error("report: zlib failed with status " + std::to_string(status));
  result.resize(size);
  return result;
}

/// Of the primary corner, by which the page draws; else of the first site.
std::optional<CurbFrame> frame_of(const ReportInput& input) {
  const Scene& scene = input.scene;
  const Model& model = input.stored.model;
  if (!scene.corners.empty()) return rescaled(scene.corners.at(scene.primary).frame, model.settings.scaling);
  if (model.sites.empty()) return std::nullopt;
  return model.sites.front().frame;
}

/// What predicts on the page: `wasm` and `model`, each deflated (RFC 1950) and in base64; of a model for which this
/// takes more than `most_bytes` only `bytes`. Null if no site is known.
ordered_json predictor_json(const ReportInput& input, std::size_t most_bytes) {
  const std::optional<CurbFrame> frame = frame_of(input);
  if (!frame) return nullptr;
  const EpisodeConfig& config = input.episode;
  std::string wasm;
  for (const char* piece : detail::kEmbeddedPredictor) wasm += piece;
  std::string model =
      detail::base64(deflated(predictor_bytes({input.stored.model, *frame, config.sampling, config.predict})));
  if (const std::size_t bytes = wasm.size() + model.size(); bytes > most_bytes)
    return {{"bytes", bytes}, {"most_bytes", most_bytes}};
  return {{"wasm", std::move(wasm)}, {"model", std::move(model)}};
}

}  // namespace

ordered_json report_data(const ReportInput& input, const ReportLimits& limits) {
  if (!input.picture.empty() && !input.scene.camera)
    throw std::invalid_argument(
        "report_data: picture is given, but the scene has no camera, by which metres become pixels");
  ordered_json data{{"sila", build_version()}, {"written_by", input.stored.sila_version}, {"name", input.name}};
  data["bytes"] = input.stored.bytes;
  data["scene"] = scene_json(input.scene, input.stored.model.settings);
  data["model"] = model_json(input.stored.model);
  data["episodes"] = episodes_json(input.stored, limits.most_bytes / 2);
  data["learning_curve"] = learning_json(input.stored);
  data["configuration"] = input.configuration;
  if (!input.tracks.empty()) add_scores(data, input, limits);
  if (!input.results.is_null()) data["results"] = input.results;
  if (ordered_json predictor = predictor_json(
          input, limits.bytes_with_predictor - std::min(limits.bytes_with_predictor, one_line(data).size()));
      !predictor.is_null())
    data["predictor"] = std::move(predictor);
  add_picture(data, input.picture, input.scene);
  return data;
}

}  // namespace sila
