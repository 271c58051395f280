#include "clock.hpp"

#include <algorithm>

namespace sila {

namespace {

/// A clock that was set back by less than clock_jump_s looks like late detections, but goes on for longer [s].
constexpr double kLasting_s = 1.0;

}  // namespace

ClockReading read_stamp(const StreamClock& clock, double t_s, bool any_track, const ServiceConfig& config) {
  const auto is_near = [&](double now_s) { return t_s >= now_s - config.late_s && t_s <= now_s + config.clock_jump_s; };
  const StreamClock at_stamp{.now_s = t_s};
  if (!clock.now_s || !any_track) return {at_stamp, std::nullopt, false};
  const double now_s = clock.ahead_s && t_s > *clock.ahead_s ? *clock.ahead_s : *clock.now_s;
  if (is_near(now_s)) {
    if (t_s > now_s + config.late_s) return {{.now_s = now_s, .ahead_s = t_s}, std::nullopt, false};
    return {{.now_s = std::max(now_s, t_s)}, std::nullopt, false};
  }
  const bool late = t_s < now_s && t_s >= now_s - config.clock_jump_s;
  const bool agrees = clock.agreeing > 0 && is_near(clock.candidate_s);
  const StreamClock questioned{clock.now_s, clock.ahead_s, agrees ? clock.since_s : t_s,
                               agrees ? std::max(clock.candidate_s, t_s) : t_s, agrees ? clock.agreeing + 1 : 1};
  const bool lasts = !late || questioned.candidate_s - questioned.since_s >= kLasting_s;
  if (questioned.agreeing >= config.clock_patience && lasts) return {at_stamp, std::nullopt, true};
  return {questioned, late ? Rejection::late : Rejection::off_clock, false};
}

}  // namespace sila
