#include "sila/core/fields.hpp"

#include <sstream>

namespace sila {

std::string describe(const Range& range) {
  std::ostringstream text;
  text << (range.open_min || std::isinf(range.min) ? "(" : "[") << range.min << ", " << range.max
       << (std::isinf(range.max) ? ")" : "]");
  return text.str();
}

void require_in_range(std::string_view function, std::string_view field, double value, const Range& range) {
  const bool above = range.open_min ? value > range.min : value >= range.min;
  if (above && value <= range.max && !std::isnan(value)) return;
  std::ostringstream text;
  text << function << ": " << field << " = " << value << " is outside " << describe(range);
  throw std::invalid_argument(text.str());
}

}  // namespace sila
