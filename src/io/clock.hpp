#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "sila/io/track_files.hpp"

namespace sila {

/// What a format or a file knows of its own clock.
struct FrameClock {
  std::optional<double> frames_per_second;
  std::optional<double> sample_interval_s;  ///< between the annotations of one person
};

/// Seconds since 1970 of an ISO 8601 date, `2024-05-03T12:00:00.25Z`: with a blank for the T, a fraction, an offset
/// such as +02:00 or none (UTC). Null for any other text.
std::optional<double> seconds_of_date(std::string_view text);

/// Detections whose `t_s` still is a frame number become detections in seconds: by the frame rate of the options, else
/// by their sample interval, else by what the format says. An interval is the time of the commonest step of a person's
/// frames. Throws: FormatError if the rate is not known.
TrackFile with_seconds(TrackFile frames, const ReadOptions& options, const FrameClock& of_format);

}  // namespace sila
