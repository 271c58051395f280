#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// Limit of the id of a live detection [bytes].
inline constexpr std::size_t kMaxIdBytes = 64;

/// One row of tracker output, before any check: it may be out of order, repeated or not finite.
struct Detection {
  std::string track;  ///< id as in the input; unique only inside one file
  double t_s = 0.0;
  Vector2 position_m = Vector2::Zero();  ///< [m]; an image point [pixels] where a camera is used
  std::string label = {};                ///< class as in the input, such as "Pedestrian"; empty when the input has none
  std::size_t line = 0;                  ///< 1-based line of the input, 0 if it has no lines; for messages only
};

/// Why a row of the input is in no trajectory.
enum class DropReason {
  missing_cells,  ///< fewer columns than the format has
  extra_cells,    ///< more cells than the header names: which is which is not known
  not_a_number,   ///< a cell that should be a number is not
  not_json,       ///< a line that is not the JSON of the format
  not_finite,     ///< NaN or infinite
  absurd_value,   ///< a coordinate beyond 3e7 m or a time stamp beyond 1e12 s
  lost,           ///< the annotator marked the person as lost; the row repeats an old position
  bad_box,        ///< a box whose width or height is not positive
  above_horizon,  ///< an image point where the camera sees no ground
  other_label,    ///< not a pedestrian
  other_camera,   ///< of another camera than the one asked for
  repeated,       ///< the same stamp and place of the same track again
  averaged,       ///< the same stamp, places that nearly agree: one mean row is kept, the others are counted here
  contradictory,  ///< the same stamp, places too far apart for one person: none is kept
  outlier,        ///< one sample far off a path that continues without it
  single_sample,  ///< alone between two cuts; a path needs two
};

struct DropReasonText {
  DropReason reason;
  std::string_view name;  ///< for JSON
  std::string_view text;  ///< for people
};

/// Every reason once, in the order of the enumeration.
inline constexpr std::array<DropReasonText, 16> kDropReasons{{
    {DropReason::missing_cells, "missing_cells", "have too few columns"},
    {DropReason::extra_cells, "extra_cells", "have more cells than the header names"},
    {DropReason::not_a_number, "not_a_number", "have a cell that is not a number"},
    {DropReason::not_json, "not_json", "are not the JSON of the format"},
    {DropReason::not_finite, "not_finite", "are not finite"},
    {DropReason::absurd_value, "absurd_value", "lie beyond 3e7 m, or at a time beyond 1e12 s"},
    {DropReason::lost, "lost", "are marked as lost"},
    {DropReason::bad_box, "bad_box", "have a box whose width or height is not positive"},
    {DropReason::above_horizon, "above_horizon", "lie where the camera sees no ground"},
    {DropReason::other_label, "other_label", "are not pedestrians"},
    {DropReason::other_camera, "other_camera", "are of another camera"},
    {DropReason::repeated, "repeated", "repeat a sample"},
    {DropReason::averaged, "averaged", "share a time stamp with near samples (their mean is kept)"},
    {DropReason::contradictory, "contradictory", "contradict another sample of the same time stamp"},
    {DropReason::outlier, "outlier", "lie far off a path that goes on without them"},
    {DropReason::single_sample, "single_sample", "stand alone (a path needs two samples)"},
}};
static_assert(kDropReasons.back().reason == DropReason::single_sample &&
              kDropReasons.size() == static_cast<std::size_t>(DropReason::single_sample) + 1);

/// The name of a reason in JSON.
std::string_view name_of(DropReason reason);

/// How many rows were dropped for one reason, and where the first of them is.
struct DroppedRows {
  DropReason reason = DropReason::missing_cells;
  std::size_t rows = 0;
  std::string first;  ///< "path:line"; with what was found, where that helps
};

/// The rows of one file (or one folder that makes one recording), in the order of the file.
/// Invariant: `rows_read` = `rows.size()` + the rows counted in `dropped`.
struct Detections {
  std::string source;  ///< path, for messages
  std::vector<Detection> rows;
  std::size_t rows_read = 0;              ///< rows of the input, those that the reader had to drop included
  std::vector<DroppedRows> dropped = {};  ///< what the reader dropped, by reason
  std::vector<std::string> warnings = {};
  bool own_clocks = false;  ///< each track has a clock of its own, so that each is a recording
};

}  // namespace sila
