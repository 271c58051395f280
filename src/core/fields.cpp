#include "sila/core/fields.hpp"

#include "core/concatenate.hpp"

namespace sila {

std::string describe(const Range& range) {
  return concatenate(range.open_min || std::isinf(range.min) ? "(" : "[", range.min, ", ", range.max,
                     std::isinf(range.max) ? ")" : "]");
}

bool inside(const Range& range, double value) {
  return (range.open_min ? value > range.min : value >= range.min) && value <= range.max;  // false for NaN
}

void require_in_range(std::string_view function, std::string_view field, double value, const Range& range) {
  if (inside(range, value)) return;
  throw invalid_argument(function, ": ", field, " = ", value, " is outside ", describe(range));
}

}  // namespace sila
