#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sila/core/clean.hpp"

namespace sila {

/// A detection as a live tracker would send it.
struct TimedLine {
  double at_s = 0.0;  ///< after the first line
  std::string track;
  double t_s = 0.0;  ///< as in the line
  std::string text;
};

/// The samples of tracks in order of time. Recordings (files) follow one another on one clock, 5 s apart, since
/// each has a clock of its own. With `apart_s` > 0 each track starts this long after the one before it instead, for
/// recordings whose tracks have no common clock. Units: seconds, metres.
std::vector<TimedLine> timed_lines(const CleanTracks& tracks, double apart_s);

/// Counts of lines sent and received.
struct ReplayReport {
  std::uint64_t sent = 0;
  std::uint64_t predictions = 0;
  std::uint64_t dropped = 0;        ///< as reported by the service
  std::uint64_t rejected = 0;       ///< as reported by the service
  std::vector<double> latencies_s;  ///< from sending a detection to reading its prediction, sorted
};

/// Sends lines to tcp:ADDRESS:PORT or unix:PATH, `rate` times as fast as recorded, after a line {"token": ...} if there
/// is a token, and passes each received line to `receive` (on another thread). Then waits for the last answers, at most
/// `linger_s`. Throws: std::invalid_argument for an invalid address, std::runtime_error if the connection fails or the
/// service closes it before the last line.
ReplayReport replay_to(const std::string& address, const std::string& token, const std::vector<TimedLine>& lines,
                       double rate, double linger_s, const std::function<void(const std::string&)>& receive);

/// Passes the lines to `send` at their times; ends with false when `send` returns false.
bool replay(const std::vector<TimedLine>& lines, double rate, const std::function<bool(const TimedLine&)>& send);

}  // namespace sila
