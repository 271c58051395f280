#pragma once

#include <optional>

#include "sila/live/config.hpp"
#include "sila/live/refusal.hpp"

namespace sila {

/// The clock of a stream: the newest time stamp that is believed.
struct StreamClock {
  std::optional<double> now_s;
  double elsewhere_s = 0.0;  ///< newest of the stamps that agree with each other and not with the clock
  int agreeing = 0;          ///< how many of them, in a row
};

/// What a time stamp means: taken (the clock may have moved on), refused, or the clock was set anew, which ends every
/// open track.
struct ClockReading {
  std::optional<Refusal> refusal;
  bool set_anew = false;
};

/// Reads one stamp. While nobody is about any time is believed. One stray stamp never moves the clock of others;
/// `clock_patience` in a row that agree do, if they are farther off than `clock_jump_s`.
/// Units: seconds on the stream's clock, finite.
ClockReading read_stamp(StreamClock& clock, double t_s, bool anybody, const LiveConfig& config);

}  // namespace sila
