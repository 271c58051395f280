#include "sila/core/fields.hpp"

#include "core/concatenate.hpp"

namespace sila {

std::string describe(const Range& range) {
  return concatenate(range.open_min || std::isinf(range.min) ? "(" : "[", range.min, ", ", range.max,
                     std::isinf(range.max) ? ")" : "]");
}

void require_in_range(std::string_view function, std::string_view field, double value, const Range& range) {
  const bool above = range.open_min ? value > range.min : value >= range.min;
  if (above && value <= range.max && !std::isnan(value)) return;
  throw std::invalid_argument(concatenate(function, ": ", field, " = ", value, " is outside ", describe(range)));
}

}  // namespace sila
