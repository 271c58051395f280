#include "live_page.hpp"

#include <algorithm>
#include <cmath>

#include "embedded_live.hpp"
#include "report/model_data.hpp"
#include "sila/io/scene.hpp"
#include "sila/version.hpp"

namespace sila {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMaxPedestrians = 200;  ///< that are drawn; the others are only counted
constexpr std::size_t kMaxModes = 6;
constexpr std::size_t kTrailSamples = 24;
constexpr double kTrail_s = 4.0;

double centimetres(double metres) {
  return std::round(metres * 100.0) / 100.0;
}

void add_point(ordered_json& list, const Vector2& point_m) {
  list.push_back(centimetres(point_m.x()));
  list.push_back(centimetres(point_m.y()));
}

ordered_json trail_json(const Trajectory& path) {
  ordered_json list = ordered_json::array();
  const double from_s = path.times_s.back() - kTrail_s;
  const auto first = std::lower_bound(path.times_s.begin(), path.times_s.end(), from_s) - path.times_s.begin();
  const std::size_t count = path.times_s.size() - static_cast<std::size_t>(first);
  const std::size_t stride = std::max<std::size_t>(1, count / kTrailSamples);
  for (std::size_t i = static_cast<std::size_t>(first); i < path.times_s.size(); ++i) {
    if ((path.times_s.size() - 1 - i) % stride == 0) add_point(list, path.positions_m[i]);
  }
  return list;
}

/// The future part of each mode: a prediction may be older than the last position.
ordered_json modes_json(const Prediction& prediction, double now_s) {
  ordered_json list = ordered_json::array();
  for (std::size_t m = 0; m < std::min(kMaxModes, prediction.modes.size()); ++m) {
    const Mode& mode = prediction.modes[m];
    ordered_json path = ordered_json::array();
    for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
      const bool past = prediction.t0_s + prediction.times_s[j] <= now_s;
      if (!past && (mode.path_m.size() - 1 - j) % 2 == 0) add_point(path, mode.path_m[j]);
    }
    list.push_back({{"weight", centimetres(mode.weight)}, {"path", std::move(path)}, {"primitives", mode.primitives}});
  }
  return list;
}

ordered_json pedestrian_json(StreamId stream, const std::string& track, const Pedestrian& pedestrian) {
  ordered_json json{{"id", std::to_string(stream) + ":" + track}, {"name", track}};
  json["trail"] = trail_json(pedestrian.track.path);
  if (pedestrian.pending.empty()) return json;
  const Prediction& prediction = pedestrian.pending.back().prediction;
  json["novelty"] = centimetres(prediction.novelty);
  json["fallback"] = prediction.fallback;
  json["modes"] = modes_json(prediction, pedestrian.track.path.times_s.back());
  return json;
}

std::string text_of(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace

std::string live_page() {
  std::string page;
  for (const char* piece : detail::kEmbeddedLivePage) page += piece;
  return page;
}

std::string hello_message(const Scene& scene, const Model& model, const std::string& picture) {
  ordered_json json{{"kind", "hello"}, {"sila", build_version()}};
  const bool of_model = scene.corners.empty() && !model.sites.empty();
  json["scene"] = scene_json(of_model ? scene_of(model) : scene, model.settings);
  json["model"] = model_json(model);
  add_picture(json, picture, scene);
  return text_of(json);
}

std::string model_message(const Model& model) {
  ordered_json json{{"kind", "model"}};
  json["model"] = model_json(model);
  return text_of(json);
}

std::string frame_message(const StreamCore& core) {
  ordered_json pedestrians = ordered_json::array();
  std::size_t count = 0;
  for (const auto& [id, stream] : core.streams) {
    for (const auto& [track, pedestrian] : stream.pedestrians) {
      if (!pedestrian.track.path.times_s.empty() && ++count <= kMaxPedestrians)
        pedestrians.push_back(pedestrian_json(id, track, pedestrian));
    }
  }
  ordered_json json{{"kind", "frame"}, {"count", count}};
  json["pedestrians"] = std::move(pedestrians);
  return text_of(json);
}

}  // namespace sila
