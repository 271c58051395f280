// Scene files. The first byte says how lengths are scaled.

#include <cmath>

#include "json_file.hpp"
#include "promises.hpp"
#include "scene_parts.hpp"
#include "text_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sila;
  using namespace sila::fuzz;
  if (size == 0) return 0;
  const std::string path = "made-up/scene.json", bytes = text_of(data + 1, size - 1);
  const auto scaling = static_cast<CurbScaling>(data[0] % kCurbScalings.size());
  bool is_text = false, is_json = false;
  Scene scene;
  try {
    const std::string text = text_of_bytes(path, bytes);
    is_text = true;
    const nlohmann::json json = json_of_text(path, text);
    is_json = true;
    scene = scene_of_json(path, json, {});
  } catch (const FormatError& error) {
    require_good_rejection(error, path, lines_in(bytes));
    require(is_json || !is_text || error.line > 0, "a text that is no JSON is rejected with its line", error.what());
    return 0;
  }
  require(!scene.corners.empty() && scene.primary < scene.corners.size(), "a scene has its primary corner");
  for (const Corner& corner : scene.corners) {
    const CurbFrame frame = rescaled(corner.frame, scaling);
    validate(frame);
    require(frame.axis_1.allFinite() && frame.axis_2.allFinite(), "axes are finite");
    for (const double width_m : {corner.widths.mean_m, corner.widths.width_1_m, corner.widths.width_2_m})
      require(width_m > 0.0 && std::isfinite(width_m), "widths are positive");
    require(to_curb(frame, frame.origin_m).allFinite(), "a frame can be used");
  }
  for (const SceneFile& file : scene.files) {
    validate(file.options);
    require(apply(file.to_scene, Vector2(1.0, 1.0)).allFinite() || std::abs(file.to_scene.a) > 1e300 ||
                std::abs(file.to_scene.b) > 1e300 || std::abs(file.to_scene.tx) > 1e300 ||
                std::abs(file.to_scene.ty) > 1e300,
            "places go into the scene");
  }
  return 0;
}
