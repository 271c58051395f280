#include "sila/sim/config.hpp"

#include <sstream>

namespace sila {

void validate(const SimulationConfig& config) {
  validate_fields("simulate", config);
  if (config.walk_phase_s <= 0.5 * config.signal_cycle_s) return;
  std::ostringstream text;
  text << "simulate: walk_phase_s = " << config.walk_phase_s
       << " is over half of signal_cycle_s = " << config.signal_cycle_s;
  throw std::invalid_argument(text.str());
}

}  // namespace sila
