#include "sila/io/scene.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <system_error>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"
#include "json_file.hpp"
#include "scene_parts.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

Corner corner_in(const JsonFields& fields, const std::string& name, const std::string& file) {
  const double mean_m = fields.positive("sidewalk_width_m");
  const SidewalkWidths widths{mean_m, fields.optional_positive("sidewalk_width_1_m").value_or(mean_m),
                              fields.optional_positive("sidewalk_width_2_m").value_or(mean_m)};
  const Vector2 origin = fields.point("origin"), axis_1 = fields.point("axis_1"), axis_2 = fields.point("axis_2");
  try {
    return {name, make_curb_frame(origin, axis_1, axis_2, mean_m), widths};
  } catch (const std::invalid_argument& error) {
    throw FormatError(file, 0, fields.where() + "axis_1, axis_2: the directions of two curbs",
                      std::string(error.what()));
  }
}

YAxis y_axis_in(const JsonFields& fields) {
  const std::string name = fields.text_or("y_axis", "up");
  if (name != "up" && name != "down") fields.reject("y_axis", "\"up\" or \"down\"");
  return name == "up" ? YAxis::up : YAxis::down;
}

bool is_primary(const JsonFields& corner, const std::string& primary_name) {
  return corner.flag_or("primary", !primary_name.empty() && corner.text_or("name", "") == primary_name);
}

bool same_place(const Corner& a, const Corner& b) {
  constexpr double tolerance = 1e-9;
  return (a.frame.origin_m - b.frame.origin_m).norm() < tolerance &&
         (a.frame.axis_1 - b.frame.axis_1).norm() < tolerance && (a.frame.axis_2 - b.frame.axis_2).norm() < tolerance &&
         std::abs(a.widths.mean_m - b.widths.mean_m) < tolerance;
}

/// The corners of the list, the primary one replaced by the first-level keys; these alone if there is no list.
void read_corners(Scene& scene, const JsonFields& fields) {
  const std::string file = scene.path.string();
  const std::string primary_name = fields.text_or("primary_corner", "");
  const Corner first_level = corner_in(fields, primary_name, file);
  for (const JsonFields& entry : fields.objects("corners")) {
    const std::string name = entry.text_or("name", std::to_string(scene.corners.size() + 1));
    Corner corner = corner_in(entry, name, file);
    if (is_primary(entry, primary_name)) {
      scene.primary = scene.corners.size();
      if (!same_place(corner, first_level)) {
        scene.warnings.push_back(file + ": " + entry.where() +
                                 "origin, axes or width differ from the first-level ones, which are used");
        corner = first_level;
        corner.name = name;
      }
    }
    scene.corners.push_back(std::move(corner));
  }
  if (!scene.corners.empty() && !same_place(scene.corners[scene.primary], first_level)) {
    scene.warnings.push_back(file + ": no entry of corners is the primary one; the first-level keys are used for it");
    scene.primary = scene.corners.size();
    scene.corners.push_back(first_level);
  }
  if (scene.corners.empty()) scene.corners.push_back(first_level);
}

ReadOptions options_in(const JsonFields& entry) {
  ReadOptions options;
  options.frames_per_second = entry.optional_positive("frames_per_second");
  options.sample_interval_s = entry.optional_positive("sample_interval_s");
  options.metres_per_unit = entry.optional_positive("metres_per_unit");
  // metres_per_pixel wins: many files have metres_per_unit = 1 without a meaning.
  if (const auto scale = entry.optional_positive("metres_per_pixel")) options.metres_per_unit = scale;
  options.person_classes = entry.texts("person_classes");
  // `format` may be a description for people; only the names of formats count.
  options.format = track_format(entry.text_or("format", ""));
  return options;
}

SimilarityTransform similarity_in(const JsonFields& entry) {
  if (!entry.has("to_scene")) return {};
  const JsonFields fields = entry.object("to_scene");
  const SimilarityTransform result{fields.number("a"), fields.number_or("b", 0.0), fields.number_or("tx", 0.0),
                                   fields.number_or("ty", 0.0)};
  if (!(std::hypot(result.a, result.b) > 0.0)) fields.reject("a", "a similarity of positive scale");
  return result;
}

std::filesystem::path resolved_in(const std::vector<std::filesystem::path>& folders, const std::string& path) {
  for (const auto& folder : folders) {
    std::error_code unknown;
    if (std::filesystem::exists(folder / path, unknown)) return (folder / path).lexically_normal();
  }
  return {};
}

/// A pair that the camera puts farther off is probably mistyped [m].
constexpr double kLargeResidual_m = 0.5;

Eigen::Matrix3d homography_in(const JsonFields& fields) {
  const char* const expected = "three rows of three numbers";
  const std::vector<std::vector<double>> rows = fields.rows("homography", 3, expected);
  if (rows.size() != 3) fields.reject("homography", expected);
  Eigen::Matrix3d matrix;
  for (std::size_t i = 0; i < 3; ++i)
    matrix.row(static_cast<Eigen::Index>(i)) = Eigen::RowVector3d::Map(rows[i].data());
  return matrix;
}

CameraFile fitted(const JsonFields& fields, const std::string& file) {
  const char* const expected = "a list of points [number, number]";
  const std::vector<std::vector<double>> image = fields.rows("image_points", 2, expected),
                                         ground = fields.rows("ground_points", 2, expected);
  if (image.size() != ground.size()) {
    fields.reject("ground_points", "as many points as image_points, " + std::to_string(image.size()) + " and not " +
                                       std::to_string(ground.size()));
  }
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < image.size(); ++i)
    pairs.push_back({{image[i][0], image[i][1]}, {ground[i][0], ground[i][1]}});
  const CameraFit fit = fit_camera(pairs);
  CameraFile result{fit.camera, {}};
  const auto worst = std::ranges::max_element(fit.residuals_m);
  if (*worst > kLargeResidual_m)
    result.warnings.push_back(concatenate(file, ": camera: pair ", worst - fit.residuals_m.begin() + 1, " of ",
                                          pairs.size(), " lies ", *worst,
                                          " m from where the fitted camera puts it; check its image and ground point"));
  return result;
}

/// As read_camera, for the JSON of a camera. `where`: the path of the object inside the file, such as "camera.".
CameraFile camera_of_json(const std::string& file, const nlohmann::json& json, const std::string& where) {
  const JsonFields fields(json, file, where);
  try {
    if (fields.has("homography") == fields.has("image_points"))
      throw std::invalid_argument(fields.has("homography") ? "both" : "neither");
    if (!fields.has("homography")) return fitted(fields, file);
    std::optional<Vector2> seen_px;
    if (fields.has("seen")) seen_px = fields.point("seen");
    return {camera_of(homography_in(fields), seen_px), {}};
  } catch (const std::invalid_argument& error) {
    throw FormatError(file, 0, "camera: image_points and ground_points of at least four places, or a homography",
                      error.what());
  }
}

nlohmann::json corner_json(const Corner& corner) {
  const CurbFrame& frame = corner.frame;
  return {{"origin", {frame.origin_m.x(), frame.origin_m.y()}}, {"axis_1", {frame.axis_1.x(), frame.axis_1.y()}},
          {"axis_2", {frame.axis_2.x(), frame.axis_2.y()}},     {"sidewalk_width_m", corner.widths.mean_m},
          {"sidewalk_width_1_m", corner.widths.width_1_m},      {"sidewalk_width_2_m", corner.widths.width_2_m}};
}

/// The matrix, and a point below the horizon: the matrix alone leaves its sign open.
nlohmann::json camera_json(const Camera& camera) {
  nlohmann::json json;
  for (int i = 0; i < 3; ++i) {
    const Eigen::RowVector3d row = camera.ground_from_image.row(i);
    json["homography"].push_back({row(0), row(1), row(2)});
  }
  const Vector2 down = camera.ground_from_image.row(2).head<2>();
  const double w = camera.ground_from_image(2, 2);  // at (0, 0)
  const Vector2 seen_px = w > 0.0 ? Vector2(0.0, 0.0) : Vector2(down * (1.0 - 2.0 * w) / down.squaredNorm());
  json["seen"] = {seen_px.x(), seen_px.y()};
  return json;
}

nlohmann::json file_json(const SceneFile& file) {
  const SimilarityTransform& s = file.to_scene;
  nlohmann::json json = {{"path", file.path}, {"to_scene", {{"a", s.a}, {"b", s.b}, {"tx", s.tx}, {"ty", s.ty}}}};
  const ReadOptions& options = file.options;
  if (options.format) json["format"] = std::string(name_of(*options.format));
  if (options.frames_per_second) json["frames_per_second"] = *options.frames_per_second;
  if (options.sample_interval_s) json["sample_interval_s"] = *options.sample_interval_s;
  if (options.metres_per_unit) json["metres_per_unit"] = *options.metres_per_unit;
  if (!options.person_classes.empty()) json["person_classes"] = options.person_classes;
  return json;
}

}  // namespace

Vector2 apply(const SimilarityTransform& s, const Vector2& point_m) {
  return {s.a * point_m.x() - s.b * point_m.y() + s.tx, s.b * point_m.x() + s.a * point_m.y() + s.ty};
}

YAxis y_axis_of(const Camera& camera) {  // v points down in the image
  return camera.ground_from_image.determinant() < 0.0 ? YAxis::up : YAxis::down;
}

/// Seen from above axis_2 is axis_1 turned counter-clockwise; where y points down that is a negative cross product.
std::vector<std::string> mirrored_axes(const Scene& scene) {
  std::vector<std::string> warnings;
  for (const Corner& corner : scene.corners) {
    if ((cross(corner.frame.axis_1, corner.frame.axis_2) > 0.0) == (scene.y_axis == YAxis::up)) continue;
    warnings.push_back(
        (scene.path.empty() ? "scene" : scene.path.string()) + ": corner '" + corner.name +
        "': axis_1 and axis_2 are mirrored (axis_2 should be axis_1 turned counter-clockwise, seen from above); "
        "swap them, or correct y_axis");
  }
  return warnings;
}

CameraFile read_camera(const std::filesystem::path& path) {
  const nlohmann::json json = read_json(path);
  const bool of_scene = json.is_object() && json.contains("camera");
  return camera_of_json(path.string(), of_scene ? json.at("camera") : json, of_scene ? "camera." : "");
}

Scene read_scene(const std::filesystem::path& path, const std::filesystem::path& data_dir) {
  return scene_of_json(path, read_json(path), data_dir);
}

Scene scene_of_json(const std::filesystem::path& path, const nlohmann::json& json,
                    const std::filesystem::path& data_dir) {
  const JsonFields fields(json, path.string(), "");
  Scene scene;
  scene.path = path;
  scene.name = fields.text_or("name", path.stem().string());
  scene.y_axis = y_axis_in(fields);
  read_corners(scene, fields);
  std::ranges::move(mirrored_axes(scene), std::back_inserter(scene.warnings));
  if (fields.has("camera")) {
    CameraFile read = camera_of_json(path.string(), json.at("camera"), "camera.");
    scene.camera = read.camera;
    std::ranges::move(read.warnings, std::back_inserter(scene.warnings));
  }
  const auto folder = std::filesystem::absolute(path).lexically_normal().parent_path();
  scene.searched = {folder, folder.parent_path()};
  if (!data_dir.empty()) scene.searched.push_back(data_dir);
  for (const JsonFields& entry : fields.objects("files")) {
    const std::string file = entry.text("path");
    scene.files.push_back({file, resolved_in(scene.searched, file), options_in(entry), similarity_in(entry)});
  }
  return scene;
}

void validate(const Scene& scene) {
  if (scene.corners.empty()) throw std::invalid_argument("scene: corners = [], at least one is needed");
  if (scene.primary >= scene.corners.size())
    throw invalid_argument("scene: primary = ", scene.primary, ", must be below ", scene.corners.size(),
                           ", the number of corners");
  for (const auto& [name, frame, widths] : scene.corners) {
    validate(frame);
    if (!(widths.width_1_m > 0.0 && widths.width_2_m > 0.0))
      throw invalid_argument("scene: sidewalk_width_1_m = ", widths.width_1_m,
                             ", sidewalk_width_2_m = ", widths.width_2_m, ", they must be positive");
  }
}

std::string to_text(const Scene& scene) {
  validate(scene);
  nlohmann::json json = corner_json(scene.corners[scene.primary]);
  json["name"] = scene.name;
  json["y_axis"] = scene.y_axis == YAxis::up ? "up" : "down";
  json["primary_corner"] = scene.corners[scene.primary].name;
  json["units"] = "metres";
  json["corners"] = nlohmann::json::array();
  for (std::size_t i = 0; i < scene.corners.size(); ++i) {
    nlohmann::json corner = corner_json(scene.corners[i]);
    corner["name"] = scene.corners[i].name;
    corner["primary"] = i == scene.primary;
    json["corners"].push_back(std::move(corner));
  }
  if (scene.camera) json["camera"] = camera_json(*scene.camera);
  json["files"] = nlohmann::json::array();
  for (const SceneFile& file : scene.files) json["files"].push_back(file_json(file));
  return json.dump(2) + "\n";
}

void write_scene(const std::filesystem::path& path, const Scene& scene) {
  write_file(path, to_text(scene));
}

std::size_t nearest_corner(const Scene& scene, const Trajectory& track) {
  if (scene.corners.empty()) throw std::invalid_argument("nearest_corner: scene.corners = [], at least one is needed");
  if (track.positions_m.empty()) throw std::invalid_argument("nearest_corner: track '" + track.id + "' has no sample");
  const Vector2& first_m = track.positions_m.front();
  const auto distance = [&](const Corner& corner) { return (corner.frame.origin_m - first_m).norm(); };
  const auto nearest = std::ranges::min_element(scene.corners, {}, distance);
  return static_cast<std::size_t>(nearest - scene.corners.begin());
}

CurbFrame frame_for(const Scene& scene, const Trajectory& track, CornerChoice corners, CurbScaling scaling) {
  validate(scene);
  const std::size_t corner = corners == CornerChoice::nearest ? nearest_corner(scene, track) : scene.primary;
  return rescaled(scene.corners[corner].frame, scaling);
}

}  // namespace sila
