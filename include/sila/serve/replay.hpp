#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sila/core/clean.hpp"

namespace sila {

/// A recording as a live tracker would send it.
struct TimedLine {
  double at_s = 0.0;  ///< after the first line
  std::string track;
  double t_s = 0.0;  ///< as in the line
  std::string text;
};

/// The samples of tracks in the order of time. Sources (files) follow one another `pause_s` apart, on one clock, for
/// each has a clock of its own; `apart_s` > 0 instead starts each track so long after the one before it, for recordings
/// whose tracks have no common clock. Units: seconds, metres.
std::vector<TimedLine> timed_lines(const CleanTracks& tracks, double apart_s, double pause_s = 5.0);

/// What came back.
struct ReplayReport {
  std::uint64_t sent = 0;
  std::uint64_t predictions = 0;
  std::uint64_t dropped = 0;        ///< as told
  std::uint64_t refused = 0;        ///< as told
  std::vector<double> latencies_s;  ///< from sending a detection to reading its prediction, sorted
};

/// Sends lines to tcp:ADDRESS:PORT or unix:PATH, `rate` times as fast as they happened, with a line {"token": ...}
/// first if there is one, and hands each line that comes back to `receive` (on a thread of its own). Then waits
/// `linger_s` for the last answers. Throws: std::invalid_argument for an address that is none, std::runtime_error if
/// nobody listens there or the connection breaks.
ReplayReport replay_to(const std::string& address, const std::string& token, const std::vector<TimedLine>& lines,
                       double rate, double linger_s, const std::function<void(const std::string&)>& receive);

/// Hands the lines to `send` at their times.
void replay(const std::vector<TimedLine>& lines, double rate, const std::function<void(const TimedLine&)>& send);

}  // namespace sila
