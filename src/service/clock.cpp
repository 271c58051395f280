#include "clock.hpp"

#include <algorithm>

namespace sila {

ClockReading read_stamp(const StreamClock& clock, double t_s, bool any_track, const ServiceConfig& config) {
  const auto is_near = [&](double now_s) { return t_s >= now_s - config.late_s && t_s <= now_s + config.clock_jump_s; };
  const StreamClock at_stamp{t_s, 0.0, 0};
  if (!clock.now_s || !any_track) return {at_stamp, std::nullopt, false};
  if (is_near(*clock.now_s)) return {{std::max(*clock.now_s, t_s), 0.0, 0}, std::nullopt, false};
  // A stamp that is slightly late does not count against the clock; one that is far off may show that the clock is
  // wrong.
  if (t_s < *clock.now_s && t_s >= *clock.now_s - config.clock_jump_s) return {clock, Rejection::late, false};
  const bool agrees = clock.agreeing > 0 && is_near(clock.candidate_s);
  const StreamClock questioned{clock.now_s, agrees ? std::max(clock.candidate_s, t_s) : t_s,
                               agrees ? clock.agreeing + 1 : 1};
  if (questioned.agreeing < config.clock_patience) return {questioned, Rejection::off_clock, false};
  return {at_stamp, std::nullopt, true};
}

}  // namespace sila
