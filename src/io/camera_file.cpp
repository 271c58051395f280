#include <algorithm>
#include <stdexcept>
#include <vector>

#include "core/concatenate.hpp"
#include "json_file.hpp"
#include "scene_json.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

/// A pair that the camera puts farther off is probably mistyped [m].
constexpr double kLargeResidual_m = 0.5;

std::vector<Vector2> points_in(const JsonFields& fields, const nlohmann::json& json, const char* key) {
  std::vector<Vector2> points;
  const auto found = json.find(key);
  if (found == json.end() || !found->is_array()) fields.reject(key, "a list of points [number, number]");
  for (const nlohmann::json& point : *found) {
    const bool pair = point.is_array() && point.size() == 2 && point[0].is_number() && point[1].is_number();
    if (!pair) fields.reject(key, "a list of points [number, number]");
    points.emplace_back(point[0].get<double>(), point[1].get<double>());
  }
  return points;
}

Eigen::Matrix3d homography_in(const JsonFields& fields, const nlohmann::json& rows) {
  Eigen::Matrix3d matrix;
  const char* const expected = "three rows of three numbers";
  if (!rows.is_array() || rows.size() != 3) fields.reject("homography", expected);
  for (int i = 0; i < 3; ++i) {
    const nlohmann::json& row = rows[static_cast<std::size_t>(i)];
    if (!row.is_array() || row.size() != 3) fields.reject("homography", expected);
    for (int j = 0; j < 3; ++j) {
      const nlohmann::json& entry = row[static_cast<std::size_t>(j)];
      if (!entry.is_number()) fields.reject("homography", expected);
      matrix(i, j) = entry.get<double>();
    }
  }
  return matrix;
}

CameraFile fitted(const JsonFields& fields, const nlohmann::json& json, const std::string& file) {
  const std::vector<Vector2> image = points_in(fields, json, "image_points");
  const std::vector<Vector2> ground = points_in(fields, json, "ground_points");
  if (image.size() != ground.size()) {
    fields.reject("ground_points", "as many points as image_points, " + std::to_string(image.size()) + " and not " +
                                       std::to_string(ground.size()));
  }
  std::vector<PointPair> pairs;
  for (std::size_t i = 0; i < image.size(); ++i) pairs.push_back({image[i], ground[i]});
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
    if (!fields.has("homography")) return fitted(fields, json, file);
    std::optional<Vector2> seen_px;
    if (fields.has("seen")) {
      const auto [u, v] = fields.pair("seen");
      seen_px = Vector2(u, v);
    }
    return {camera_of(homography_in(fields, json.at("homography")), seen_px), {}};
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
