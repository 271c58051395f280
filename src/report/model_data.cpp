#include "report/model_data.hpp"

#include <algorithm>

#include "encode.hpp"
#include "sila/io/reports.hpp"

namespace sila {
namespace {

using detail::point_json;
using detail::rounded;
using nlohmann::ordered_json;

ordered_json corner_json(const Corner& corner, CurbScaling scaling) {
  const CurbFrame frame = rescaled(corner.frame, scaling);
  return {{"name", corner.name},
          {"origin", point_json(frame.origin_m)},
          {"axis_1", point_json(frame.axis_1, 6)},
          {"axis_2", point_json(frame.axis_2, 6)},
          {"curbs", {point_json(corner.frame.axis_1, 6), point_json(corner.frame.axis_2, 6)}},
          {"unit_m", point_json(frame.unit_m)},
          {"widths_m", {rounded(corner.widths.width_1_m, 3), rounded(corner.widths.width_2_m, 3)}}};
}

/// Where a model without a scene is drawn.
Scene right_angled(double width_m) {
  Scene scene;
  scene.name = "a right-angled corner";
  const SidewalkWidths widths{width_m, width_m, width_m};
  scene.corners.push_back({"corner", make_curb_frame({0, 0}, {1, 0}, {0, 1}, width_m), widths});
  return scene;
}

}  // namespace

ordered_json scene_json(const Scene& scene, const ModelSettings& settings) {
  if (scene.corners.empty()) {
    ordered_json json = scene_json(right_angled(settings.reference_width_m), settings);
    json["known"] = false;
    return json;
  }
  ordered_json json{{"name", scene.name},
                    {"known", true},
                    {"y_axis", scene.y_axis == YAxis::up ? "up" : "down"},
                    {"primary", scene.primary}};
  json["corners"] = ordered_json::array();
  for (const Corner& corner : scene.corners) json["corners"].push_back(corner_json(corner, settings.scaling));
  return json;
}

ordered_json camera_json(const Camera& camera) {
  const Eigen::Matrix3d columns_are_rows = camera.ground_from_image.transpose();
  return std::vector<double>(columns_are_rows.data(), columns_are_rows.data() + columns_are_rows.size());
}

void add_picture(ordered_json& data, const std::string& picture, const Scene& scene) {
  if (picture.empty()) return;
  data["picture"] = picture;
  data["camera"] = camera_json(scene.camera.value());
}

ordered_json tracks_json(std::span<const FramedTrajectory> tracks, std::size_t most) {
  constexpr double kDrawnEvery_s = 0.4;
  ordered_json list = ordered_json::array();
  const std::size_t n = std::min(tracks.size(), most);
  for (std::size_t k = 0; k < n; ++k) {
    const Trajectory& track = tracks[k * tracks.size() / n].track;
    std::vector<Vector2> path_m;
    double due_s = track.times_s.front();
    for (std::size_t i = 0; i < track.times_s.size(); ++i) {
      if (track.times_s[i] < due_s - 1e-9) continue;
      path_m.push_back(track.positions_m[i]);
      due_s = track.times_s[i] + kDrawnEvery_s;
    }
    list.push_back(detail::path_json(path_m));
  }
  return list;
}

ordered_json model_json(const Model& model) {
  ordered_json json{{"size", size(model)},
                    {"tracks", model.tracks},
                    {"episodes", model.episodes},
                    {"interval_s", model.settings.sample_interval_s}};
  const Grid& grid = model.settings.grid;
  json["grid"] = {{"cell", grid.cell}, {"origin", point_json(grid.origin)}, {"tile_cells", grid.tile_cells}};
  json["primitives"] = ordered_json::array();
  for (const MotionPrimitive& primitive : model.primitives)
    json["primitives"].push_back({{"weight", rounded(primitive.weight, 3)}, {"cells", cells_json(primitive)}});
  json["transitions"] = ordered_json::array();
  for (const Transition& edge : model.transitions)
    json["transitions"].push_back({edge.from, edge.to, rounded(edge.count, 3)});
  return json;
}

ordered_json episodes_json(const StoredModel& stored, std::size_t most_bytes) {
  std::size_t bytes = 0;
  for (const EpisodeRecord& episode : stored.episodes) bytes += episode.statistics.size();
  ordered_json list = ordered_json::array();
  for (const EpisodeRecord& episode : stored.episodes) {
    ordered_json statistics = ordered_json::parse(episode.statistics, nullptr, false);
    if (!statistics.is_object()) statistics = ordered_json::object();
    if (bytes > most_bytes) statistics.erase("change");
    ordered_json& record = list.emplace_back(record_json(episode));
    record["seconds"] = rounded(episode.seconds, 4);
    record["statistics"] = std::move(statistics);
  }
  return list;
}

}  // namespace sila
