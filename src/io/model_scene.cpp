#include <algorithm>
#include <iomanip>
#include <limits>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "core/track_frame.hpp"
#include "sila/io/scene.hpp"

namespace sila {
namespace {

Scene scene_of(const CurbFrame& frame) {
  const double width_m = frame.sidewalk_width_m;
  Scene scene;
  scene.corners.push_back({"1", frame, {width_m, width_m, width_m}});
  return scene;
}

/// Tracks of one place lie nearer to what was learnt there [m].
constexpr double kAnotherPlace_m = 500.0;
/// Corners of two sides of a street are farther apart [m].
constexpr double kSameCorner_m = 5.0;

/// Another scene beside a frame that was made from tracks would put later tracks into other cells than the earlier
/// ones.
void require_same_frame(const Scene& given, const Model& model) {
  if (!frame_from_tracks(model) || find_site(model.sites, given.corners[given.primary].frame)) return;
  throw std::invalid_argument("scene = " + (given.path.empty() ? "\"" + given.name + "\"" : given.path.string()) +
                              " is not the frame that the model made from its first tracks; leave the scene out, give "
                              "the one that `sila scene show` prints, or learn a new model with this scene");
}

}  // namespace

Scene scene_of(const Model& model) {
  if (model.sites.empty()) throw std::invalid_argument("scene: the model has learnt nothing, so it has no frame");
  Scene scene;
  for (const Site& site : model.sites) {
    Corner corner = scene_of(site.frame).corners.front();
    corner.frame.unit_m = Vector2::Ones();
    corner.name = std::to_string(scene.corners.size() + 1);
    scene.corners.push_back(std::move(corner));
  }
  const CurbFrame& first = scene.corners.front().frame;
  if (cross(first.axis_1, first.axis_2) < 0.0) scene.y_axis = YAxis::down;
  return scene;
}

std::optional<CurbFrame> frame_from_tracks(const Model& model) {
  const auto found = std::ranges::find_if(model.sites, [](const Site& site) { return site.frame.from_tracks; });
  if (found == model.sites.end()) return std::nullopt;
  return found->frame;
}

CurbFrame live_frame(const Scene& scene, const Model& model, const Trajectory& track, CornerChoice corners,
                     CurbScaling scaling) {
  if (!scene.corners.empty()) return frame_for(scene, track, corners, scaling);
  CurbFrame provisional;
  provisional.from_tracks = true;
  return frame_from_tracks(model).value_or(provisional);
}

Scene scene_for(const Scene& given, const Model& model, std::span<const FramedTrajectory> first_batch,
                CornerChoice corners) {
  if (!given.corners.empty()) {
    validate(given);
    require_same_frame(given, model);
    return given;
  }
  Scene scene = model.sites.empty() ? scene_of(frame_of_tracks(first_batch)) : scene_of(model);
  scene.camera = given.camera;
  if (model.sites.size() > 1 && corners == CornerChoice::primary)
    throw invalid_argument("scene: the model knows ", model.sites.size(),
                           " sites; give the scene of these tracks, or the setting corners=nearest");
  return scene;
}

std::string warning_of_another_place(const Model& model, std::span<const FramedTrajectory> batch) {
  std::vector<Vector2> positions;  // curb units
  for (const FramedTrajectory& entry : batch) {
    for (const Vector2& position_m : entry.track.positions_m) positions.push_back(to_curb(entry.frame, position_m));
  }
  if (positions.empty()) return {};
  const Vector2 middle = median_position(positions);
  const Matrix2 to_metres = world_from_curb(batch.front().frame);
  const auto distance_m = [&](const Vector2& point) { return (to_metres * (point - middle)).norm(); };
  double nearest_m = model.empty() ? distance_m(Vector2::Zero()) : std::numeric_limits<double>::infinity();
  for (const MotionPrimitive& primitive : model.primitives) {
    for (const CellVelocity& entry : primitive.cells)
      nearest_m = std::min(nearest_m, distance_m(centre_of(model.settings.grid, entry.cell)));
  }
  if (nearest_m <= kAnotherPlace_m) return {};
  return concatenate("the tracks lie ", std::fixed, std::setprecision(1), nearest_m / 1000.0, " km from ",
                     model.empty() ? "the corner of the scene" : "what the model has learnt",
                     ": is it another place? learn another model, or give its scene");
}

std::string warning_of_moved_corner(const Model& model, const Scene& scene) {
  const auto frame_of = [&](const Corner& corner) { return rescaled(corner.frame, model.settings.scaling); };
  for (const Corner& corner : scene.corners) {
    if (find_site(model.sites, frame_of(corner))) continue;
    for (std::size_t site = 0; site < model.sites.size(); ++site) {
      const CurbFrame& known = model.sites[site].frame;
      const double distance_m = (known.origin_m - corner.frame.origin_m).norm();
      const bool in_scene =
          std::ranges::any_of(scene.corners, [&](const Corner& other) { return same_site(frame_of(other), known); });
      if (in_scene || distance_m > kSameCorner_m) continue;
      return concatenate("corner \"", corner.name, "\" of the scene is ", std::setprecision(2), distance_m,
                         " m from that of site ", site + 1,
                         " of the model, or has other axes, and counts as another site; if it is the same corner, give "
                         "the scene that `sila scene show` prints");
    }
  }
  return {};
}

std::string warning_of_own_frames(const Model& previous, const Model& incoming, const Model& fused) {
  if (!frame_from_tracks(previous) && !frame_from_tracks(incoming)) return {};
  if (previous.empty() || incoming.empty() || size(fused) < size(previous) + size(incoming)) return {};
  return "nothing was fused, as one frame or both were made from tracks and differ; learn into one model, or give both "
         "the scene that `sila scene show` prints";
}

std::vector<FramedTrajectory> without_frames(std::vector<Trajectory> tracks) {
  std::vector<FramedTrajectory> result;
  for (Trajectory& track : tracks) result.push_back({std::move(track), {}});
  return result;
}

void place(std::span<FramedTrajectory> tracks, const Scene& scene, CornerChoice corners, CurbScaling scaling) {
  for (FramedTrajectory& entry : tracks) entry.frame = frame_for(scene, entry.track, corners, scaling);
}

}  // namespace sila
