#pragma once

#include <concepts>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace sila {

/// A struct, or the same struct constant: for functions that list its members to read or to write them.
template <class T, class Struct>
concept MaybeConst = std::same_as<std::remove_const_t<T>, Struct>;

/// The admitted interval of a number; `open_min` leaves the lower end out.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool open_min = false;
};

// Beside each configuration struct is
//
//     void fields(MaybeConst<CleanConfig> auto& config, auto&& visit)
//
// that calls `visit.number(name, member, Range, unit, text)`, `visit.flag(name, member, text)`,
// `visit.choice(name, member, choice_names, text)` and `visit.group(name, member)` once per member, in order.
// Validation, JSON, `--set` and the documentation are all visitors of that one list.

/// The range as text, such as "(0, 1]".
std::string describe(const Range& range);

/// Whether the range contains the value; never NaN.
bool inside(const Range& range, double value);

/// Throws std::invalid_argument "<function>: <field> = <value> is outside <range>".
void require_in_range(std::string_view function, std::string_view field, double value, const Range& range);

/// Visits every field of a configuration and throws std::invalid_argument for the first one out of its range.
class RangeCheck {
 public:
  explicit RangeCheck(std::string_view function) : function_(function) {}

  template <class Number>
  void number(const char* name, const Number& value, const Range& range, const char*, const char*) {
    require_in_range(function_, prefix_ + name, static_cast<double>(value), range);
  }
  void flag(const char*, const bool&, const char*) {}
  template <class Enum>
  void choice(const char*, const Enum&, std::span<const char* const>, const char*) {}
  template <class Group>
  void group(const char* name, const Group& nested) {
    const std::string outer = prefix_;
    prefix_.append(name).append(".");
    fields(nested, *this);
    prefix_ = outer;
  }

 private:
  std::string function_;
  std::string prefix_;
};

/// Throws std::invalid_argument for the first field out of its range, naming `function`, the field, its value and the
/// rule.
template <class Config>
void validate_fields(std::string_view function, const Config& config) {
  fields(config, RangeCheck(function));
}

}  // namespace sila
