#include "live_page.hpp"

#include <algorithm>

#include "embedded_live.hpp"
#include "io/json_file.hpp"
#include "report/encode.hpp"
#include "report/model_data.hpp"
#include "sila/version.hpp"

namespace sila {
namespace {

using detail::path_json;
using detail::rounded;
using nlohmann::ordered_json;

constexpr std::size_t kMaxPedestrians = 200;  ///< that are drawn; the others are only counted
constexpr std::size_t kMaxModes = 6;
constexpr std::size_t kTrailSamples = 24;
constexpr double kTrail_s = 4.0;

ordered_json trail_json(const Trajectory& path) {
  const double from_s = path.times_s.back() - kTrail_s;
  const auto first = std::ranges::lower_bound(path.times_s, from_s) - path.times_s.begin();
  const auto trail = std::span(path.positions_m).subspan(static_cast<std::size_t>(first));
  return path_json(trail, std::max<std::size_t>(1, trail.size() / kTrailSamples));
}

/// The future part of each mode: a prediction may be older than the last position.
ordered_json modes_json(const Prediction& prediction, double now_s) {
  ordered_json list = ordered_json::array();
  const auto future = std::ranges::upper_bound(prediction.times_s, now_s - prediction.t0_s);
  const auto first = static_cast<std::size_t>(future - prediction.times_s.begin());
  for (std::size_t m = 0; m < std::min(kMaxModes, prediction.modes.size()); ++m) {
    const Mode& mode = prediction.modes[m];
    list.push_back({{"weight", rounded(mode.weight, 2)},
                    {"path", path_json(std::span(mode.path_m).subspan(first), 2)},
                    {"primitives", mode.primitives}});
  }
  return list;
}

ordered_json pedestrian_json(StreamId stream, const std::string& track, const Pedestrian& pedestrian) {
  ordered_json json{{"id", std::to_string(stream) + ":" + track}, {"name", track}};
  json["trail"] = trail_json(pedestrian.track.path);
  if (pedestrian.pending.empty()) return json;
  const Prediction& prediction = pedestrian.pending.back();
  json["novelty"] = rounded(prediction.novelty, 2);
  json["fallback"] = prediction.fallback;
  json["modes"] = modes_json(prediction, pedestrian.track.path.times_s.back());
  return json;
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
  return one_line(json);
}

std::string model_message(const Model& model) {
  ordered_json json{{"kind", "model"}};
  if (!model.sites.empty()) json["scene"] = scene_json(scene_of(model), model.settings);
  json["model"] = model_json(model);
  return one_line(json);
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
  return one_line(json);
}

}  // namespace sila
