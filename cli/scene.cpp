#include "sila/io/scene.hpp"

#include <cmath>
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <utility>

#include "options.hpp"
#include "sila/core/corner_proposal.hpp"
#include "sila/io/model_file.hpp"
#include "verbs.hpp"

namespace sila::cli {
namespace {

struct MakeOptions {
  CommonOptions common;
  TrackOptions tracks;
};

constexpr double kDegrees = 180.0 / std::numbers::pi;

double heading_deg(const Vector2& axis) {
  return std::atan2(axis.y(), axis.x()) * kDegrees;
}

/// What is proposed, and how sure that is, in plain words.
std::string describe(const CornerProposal& made) {
  const CurbFrame& frame = made.frame;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "corner at x = " << frame.origin_m.x()
       << " m, y = " << frame.origin_m.y() << " m (standard error " << made.origin_error_m
       << " m): " << made.turning_tracks << " tracks turn here\n";
  const auto axis = [&](int number, const Vector2& direction, double share, double width_m) {
    text << "axis " << number << ": heading " << std::setprecision(0) << heading_deg(direction) << " degrees, "
         << 100.0 * share << " % of the distance walked, in a strip of " << std::setprecision(1) << width_m << " m\n";
  };
  axis(1, frame.axis_1, made.share_1, made.widths.width_1_m);
  axis(2, frame.axis_2, made.share_2, made.widths.width_2_m);
  text << "standard error of the headings: " << made.axis_error_rad * kDegrees << " degrees\n";
  text << "tracks show where people turn, not the curb: compare the corner with a picture or a map before use\n";
  return text.str();
}

void make(const MakeOptions& options) {
  const Config config = configured(options.common);
  ReadTracks read = read_clean(options.tracks, config);
  const CornerProposal made = propose_corner(read.tracks.trajectories, config.episode.scaling);
  Scene scene = std::move(read.scene);
  if (scene.name.empty()) scene.name = std::filesystem::path(options.tracks.paths.front()).stem().string();
  scene.corners = {{"corner", made.frame, made.widths}};
  scene.primary = 0;
  if (!options.common.json) std::cerr << describe(made);
  auto json = nlohmann::json::parse(to_text(scene));
  nlohmann::json& corner = json["corners"][0];
  corner["origin_uncertainty_m"] = made.origin_error_m;
  corner["axis_uncertainty_deg"] = made.axis_error_rad * kDegrees;
  corner["turning_tracks"] = made.turning_tracks;
  std::cout << json.dump(2) << "\n";
}

}  // namespace

void add_scene(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("scene", "Scene files: where a place has its corners.");
  verb->require_subcommand(1);
  CLI::App* show = verb->add_subcommand("show", "Print the frames of a model as a scene file.");
  show->footer("Example:\n  sila scene show corner.sila > corner.json");
  auto model = std::make_shared<std::string>();
  show->add_option("model", *model, "model file")->required()->type_name("M.sila");
  show->callback([model] { std::cout << to_text(scene_of(load_model(*model).model)); });
  auto options = std::make_shared<MakeOptions>();
  CLI::App* made = add_verb(*verb, "make", "Propose a scene file from tracks: the corner at which most of them turn.",
                            "sila scene make tracks.csv > corner.json", options->common);
  add_tracks(*made, options->tracks);
  for (const char* unused : {"--hold-out", "--split"}) made->remove_option(made->get_option(unused));
  made->callback([options] { make(*options); });
}

}  // namespace sila::cli
