#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sila/core/clean.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/scene.hpp"

namespace sila {

/// Limits of the content of a report; the report says how much was left out.
struct ReportLimits {
  std::size_t drawn_tracks = 300;      ///< that are drawn under the primitives
  std::size_t predicted_tracks = 32;   ///< that can be played, the worst of them among them
  std::size_t worst = 12;              ///< rows of the table of the worst
  double stride_s = 1.0;               ///< between the predictions of a played track
  std::size_t most_bytes = 1'400'000;  ///< of the data; predicted tracks are halved until they fit
  /// Bytes of the data with predictor and model, which are left out beyond it, so that a page has at most 4 MB.
  std::size_t bytes_with_predictor = 3'600'000;
};

/// A place and the people to score a model on; without tracks the model is shown alone, without a scene it is drawn at
/// a right-angled corner.
struct ReportInput {
  StoredModel stored;
  std::string name;  ///< for the title
  Scene scene;       ///< no corner: none is known
  std::vector<FramedTrajectory> tracks;
  TrackReport rows;
  EpisodeConfig episode;
  EvaluateConfig evaluate;
  nlohmann::ordered_json configuration;
  nlohmann::ordered_json results;  ///< of `sila experiment`, for the learning curves; null: none
  std::string picture;  ///< data URL of what the scene's camera sees, on which predictions are drawn; empty: none
};

/// The data of a report on a model (docs/viewer.md has its keys), metres in the world frame, rounded to centimetres.
/// Throws: std::invalid_argument for a configuration out of range, and a picture of a scene without a camera.
nlohmann::ordered_json report_data(const ReportInput& input, const ReportLimits& limits = {});

/// A scene to be edited by hand, and the tracks and the picture under it.
struct EditorInput {
  Scene scene;            ///< no corner: none is known yet, the page places it once it has a camera
  nlohmann::json file;    ///< content of the present scene file, its camera included; null: there is none
  std::string file_name;  ///< under which the page saves it
  std::string proposal;   ///< a sentence on where the corner comes from
  std::vector<FramedTrajectory> tracks;
  bool in_picture = false;  ///< the tracks come from image points: by the scene's camera, or as they are without one
  std::string picture;      ///< data URL; empty: none
};

/// The data of the page of `sila scene edit`, at most `most_bytes` without the picture: fewer tracks if need be.
/// Throws: std::invalid_argument for no track.
nlohmann::ordered_json editor_data(const EditorInput& input, std::size_t most_bytes = 1'400'000);

/// The editor with its data inside, as `report_page`.
std::string editor_page(const nlohmann::ordered_json& data);

/// A picture as a data URL. Throws: FormatError for a file that cannot be read or is neither PNG nor JPEG.
std::string picture_url(const std::filesystem::path& path);

/// The viewer with its data inside: one HTML page that needs nothing else.
std::string report_page(const nlohmann::ordered_json& data);

}  // namespace sila
