#include <algorithm>

#include "core/concatenate.hpp"
#include "json_file.hpp"
#include "scene_parts.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

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

}  // namespace

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

CameraFile read_camera(const std::filesystem::path& path) {
  const nlohmann::json json = read_json(path);
  const bool of_scene = json.is_object() && json.contains("camera");
  return camera_of_json(path.string(), of_scene ? json.at("camera") : json, of_scene ? "camera." : "");
}

}  // namespace sila
