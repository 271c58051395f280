#include "arrays.hpp"

namespace sila::python {
namespace {

using Numbers = nb::ndarray<const double, nb::c_contig>;

std::string shape_text(const Numbers& array) {
  std::string text = "(";
  for (std::size_t i = 0; i < array.ndim(); ++i) text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

[[noreturn]] void reject(const char* argument, const std::string& expected, const std::string& found) {
  throw nb::value_error((std::string(argument) + ": expected " + expected + ", found " + found).c_str());
}

/// The numbers, NaN where they are masked, and the array that owns them.
std::pair<nb::object, Numbers> numbers_in(const char* argument, const std::string& expected, nb::handle given) {
  const nb::module_ numpy = nb::module_::import_("numpy");
  nb::object array;
  std::string kind;
  try {
    array = numpy.attr("asanyarray")(given);
    kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
    if (nb::hasattr(array, "filled")) array = array.attr("astype")("float64").attr("filled")(numpy.attr("nan"));
    array = numpy.attr("ascontiguousarray")(array, "float64");
  } catch (nb::python_error&) {
    reject(argument, "numbers of shape " + expected, nb::cast<std::string>(nb::str(given.type().attr("__name__"))));
  }
  if (kind == "m" || kind == "M") reject(argument, "numbers of shape " + expected, "dates or durations");
  return {array, nb::cast<Numbers>(array)};
}

}  // namespace

std::vector<Vector2> points_from(const char* argument, nb::handle given) {
  const auto [owner, array] = numbers_in(argument, "(n, 2)", given);
  if (array.ndim() != 2 || array.shape(1) != 2) reject(argument, "shape (n, 2)", "shape " + shape_text(array));
  std::vector<Vector2> points(array.shape(0));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = {array.data()[2 * i], array.data()[2 * i + 1]};
  return points;
}

std::vector<Vector2> finite_points_from(const char* argument, nb::handle given) {
  std::vector<Vector2> points = points_from(argument, given);
  for (std::size_t row = 0; row < points.size(); ++row) {
    if (!points[row].allFinite()) reject(argument, "finite numbers", "another in row " + std::to_string(row));
  }
  return points;
}

std::vector<double> numbers_from(const char* argument, nb::handle given) {
  const auto [owner, array] = numbers_in(argument, "(n,)", given);
  if (array.ndim() != 1) reject(argument, "shape (n,)", "shape " + shape_text(array));
  return {array.data(), array.data() + array.size()};
}

Vector2 pair_from(const char* argument, nb::handle given) {
  const auto [owner, array] = numbers_in(argument, "(2,)", given);
  if (array.ndim() != 1 || array.size() != 2) reject(argument, "shape (2,)", "shape " + shape_text(array));
  return {array.data()[0], array.data()[1]};
}

}  // namespace sila::python
