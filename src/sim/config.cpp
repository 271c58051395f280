#include "sila/sim/config.hpp"

namespace sila {

void validate(const SimulationConfig& config) {
  validate_fields("simulate", config);
}

}  // namespace sila
