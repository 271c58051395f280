#include "sila/live/clock.hpp"

#include <algorithm>

namespace sila {

ClockReading read_stamp(StreamClock& clock, double t_s, bool anybody, const LiveConfig& config) {
  const auto near = [&](double now_s) { return t_s >= now_s - config.late_s && t_s <= now_s + config.clock_jump_s; };
  if (!clock.now_s || !anybody) {
    clock = {t_s, 0.0, 0};
    return {};
  }
  if (near(*clock.now_s)) {
    clock = {std::max(*clock.now_s, t_s), 0.0, 0};
    return {};
  }
  // A camera that is behind by a little will catch up; only who is far off may be right where the clock is wrong.
  if (t_s < *clock.now_s && t_s >= *clock.now_s - config.clock_jump_s) return {Refusal::late, false};
  const bool agrees = clock.agreeing > 0 && near(clock.elsewhere_s);
  clock.agreeing = agrees ? clock.agreeing + 1 : 1;
  clock.elsewhere_s = agrees ? std::max(clock.elsewhere_s, t_s) : t_s;
  if (clock.agreeing < config.clock_patience) return {Refusal::off_clock, false};
  clock = {t_s, 0.0, 0};
  return {std::nullopt, true};
}

}  // namespace sila
