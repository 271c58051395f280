#pragma once

#include "sila/service/stream.hpp"

namespace sila {

/// The clock after a time stamp, and whether the stamp is accepted. A reset ends every open track.
struct ClockReading {
  StreamClock clock;
  std::optional<Rejection> rejection;
  bool reset = false;
};

/// Reads one time stamp. While no track is open any time is accepted. One stray stamp never moves the clock: a stamp
/// ahead of it by over `late_s` is accepted, but moves it only if a newer one follows; the clock is reset by
/// `clock_patience` consecutive stamps that agree with each other and are off it by over `clock_jump_s`, or are late
/// but span a second.
/// Units: seconds on the clock of the stream, finite.
ClockReading read_stamp(const StreamClock& clock, double t_s, bool any_track, const ServiceConfig& config);

}  // namespace sila
