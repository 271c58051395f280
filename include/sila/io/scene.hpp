#pragma once

#include <cstddef>

#include "sila/io/track_files.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The corner whose frame a track gets, in a scene of several corners.
enum class CornerChoice {
  primary,  ///< the primary corner of the scene, for all tracks
  nearest,  ///< the corner nearest to the track
};
inline constexpr const char* kCornerChoices[] = {"primary", "nearest"};

/// p_scene = [[a, -b], [b, a]] p_file + (tx, ty), p_file in metres.
struct SimilarityTransform {
  double a = 1.0;
  double b = 0.0;
  double tx = 0.0;
  double ty = 0.0;
  bool operator==(const SimilarityTransform&) const = default;
};

/// The point in the frame of the scene [m].
Vector2 apply(const SimilarityTransform& similarity, const Vector2& point_m);

/// One entry of a scene's `files`.
struct SceneFile {
  std::string path;                ///< as the scene file has it
  std::filesystem::path resolved;  ///< the readable file or folder; empty if there is none
  ReadOptions options;
  SimilarityTransform to_scene;
};

/// A corner of a scene.
struct Corner {
  std::string name;
  CurbFrame frame;  ///< in metres
  SidewalkWidths widths;
};

/// The direction of the y axis of the scene's metres: `down` in image frames.
enum class YAxis { up, down };

/// A place: where the corners are and which files were recorded there.
/// Invariant: at least one corner, `primary` < corners.size(), every frame valid.
struct Scene {
  std::string name;
  std::filesystem::path path;  ///< of the scene file, for messages
  YAxis y_axis = YAxis::up;
  std::vector<Corner> corners;
  std::size_t primary = 0;
  std::vector<SceneFile> files;
  std::optional<Camera> camera;                 ///< by which pixels become metres
  std::vector<std::filesystem::path> searched;  ///< folders in which the paths of `files` were looked for
  std::vector<std::string> warnings;
};

/// Reads a scene file (docs/formats.md). The first-level `origin`, `axis_1`, `axis_2`, `sidewalk_width_m` are the
/// primary corner. Paths of `files` are looked for in the folder of the scene file, in that folder's parent, and in
/// `data_dir` if it is given; a path that is not found is an error only when its tracks are needed. Throws: FormatError
/// naming the file and the field for anything missing or wrong, near-parallel axes and zero widths included.
Scene read_scene(const std::filesystem::path& path, const std::filesystem::path& data_dir = {});

struct CameraFile {
  Camera camera;
  std::vector<std::string> warnings;  ///< about large residuals
};
/// Reads the `camera` of a scene file, or of a file that has only a camera.
/// Throws: FormatError naming the file for a camera that is missing, malformed or degenerate.
CameraFile read_camera(const std::filesystem::path& path);

/// The direction of the y axis of the ground that a camera sees from above.
YAxis y_axis_of(const Camera& camera);

/// Throws: std::invalid_argument if the invariant does not hold.
void validate(const Scene& scene);

/// A warning for each corner whose axis_2 is not axis_1 turned counter-clockwise, seen from above.
std::vector<std::string> mirrored_axes(const Scene& scene);

/// A scene file: the text that `read_scene` reads. Throws: as validate.
std::string to_text(const Scene& scene);

/// Writes it. Throws: FormatError if the path cannot be written.
void write_scene(const std::filesystem::path& path, const Scene& scene);

/// The corner whose origin is nearest to the first position of the track: later ones would make it depend on the
/// future. Throws: std::invalid_argument for no corner or sample.
std::size_t nearest_corner(const Scene& scene, const Trajectory& track);

/// The frame that a track gets, with that unit. Throws: as validate and nearest_corner.
CurbFrame frame_for(const Scene& scene, const Trajectory& track, CornerChoice corners, CurbScaling scaling);

/// The sites of a model as the corners of a scene, the first one primary. Throws: std::invalid_argument for a model
/// without sites.
Scene scene_of(const Model& model);

/// The frame that a model made from its first batch; null for an empty model, and for one that began with a scene file.
std::optional<CurbFrame> frame_from_tracks(const Model& model);

/// The frame of a track of a live stream: that of the scene, if it has a corner, else the one that the model made from
/// its first batch. Until then it is a provisional one, with `from_tracks` set. For a model that began with a scene
/// file, `scene` must have its corners: use that of `scene_for`.
CurbFrame live_frame(const Scene& scene, const Model& model, const Trajectory& track, CornerChoice corners,
                     CurbScaling scaling);

/// The scene that gives tracks their frames, for every verb that takes a model: `given` if it has a corner, else that
/// of the model, else (for an empty model) one whose frame is made from `first_batch`; the model then keeps it for its
/// life. The camera of `given` is kept in any case. Throws: std::invalid_argument for a given scene that breaks its
/// invariant or has another frame than that which a model made from its first batch; for a model of several sites
/// without a given scene, unless `corners` is nearest; if model, scene and batch are all empty.
Scene scene_for(const Scene& given, const Model& model, std::span<const FramedTrajectory> first_batch,
                CornerChoice corners);

/// A sentence if the median position of a batch that has its frames lies more than 500 m from every cell of the model,
/// or, if the model has none, from the corner; else empty.
std::string warning_of_another_place(const Model& model, std::span<const FramedTrajectory> batch);

/// A sentence if a corner of the scene is no site of the model but lies within 5 m of one that the scene does not have:
/// then it may be a measurement of the same corner; else empty.
std::string warning_of_moved_corner(const Model& model, const Scene& scene);

/// A sentence if a model made its frame from tracks and no part of one was fused with a part of the other, so that they
/// may be one place in two frames; else empty.
std::string warning_of_own_frames(const Model& previous, const Model& incoming, const Model& fused);

/// Tracks with the default frame, for `place`.
std::vector<FramedTrajectory> without_frames(std::vector<Trajectory> tracks);

/// Gives each track the frame of its corner. Throws: as frame_for.
void place(std::span<FramedTrajectory> tracks, const Scene& scene, CornerChoice corners, CurbScaling scaling);

}  // namespace sila
