#pragma once

#include <utility>

#include "bindings.hpp"

namespace sila::python {

/// Arrays that Python gets: of one owner, or views into a bound object that live as long as it and cannot be written.
using Array = nb::ndarray<nb::numpy, double, nb::c_contig>;
using View = nb::ndarray<nb::numpy, const double, nb::c_contig>;

/// A new array with these numbers, row by row.
template <class Number>
nb::ndarray<nb::numpy, Number, nb::c_contig> array_of(std::vector<Number> numbers,
                                                      std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<Number>(std::move(numbers));
  const nb::capsule owner(kept, [](void* data) noexcept { delete static_cast<std::vector<Number>*>(data); });
  return nb::ndarray<nb::numpy, Number, nb::c_contig>(kept->data(), shape, owner);
}

/// The numbers of points or matrices, row by row.
inline void append(std::vector<double>& numbers, std::span<const Vector2> points) {
  for (const Vector2& point : points) numbers.insert(numbers.end(), {point.x(), point.y()});
}
inline void append(std::vector<double>& numbers, std::span<const Matrix2> matrices) {
  for (const Matrix2& m : matrices) numbers.insert(numbers.end(), {m(0, 0), m(0, 1), m(1, 0), m(1, 1)});
}

/// n x 2, a copy.
inline Array array_of_points(const std::vector<Vector2>& points) {
  std::vector<double> numbers;
  append(numbers, points);
  return array_of(std::move(numbers), {points.size(), 2});
}

inline Array array_of_pair(const Vector2& pair) {
  return array_of(std::vector<double>{pair.x(), pair.y()}, {2});
}

inline View view_of(const std::vector<double>& numbers) {
  return View(numbers.data(), {numbers.size()});
}

inline View view_of(const std::vector<Vector2>& points) {
  static_assert(sizeof(Vector2) == 2 * sizeof(double));
  return View(points.empty() ? nullptr : points.front().data(), {points.size(), 2});
}

/// Points from anything of which NumPy makes an array of shape (n, 2).
/// Throws: ValueError "<argument>: expected shape (n, 2), found ...".
std::vector<Vector2> points_from(const char* argument, nb::handle given);
/// The same; every number is finite. Throws: ValueError that names the first row with another.
std::vector<Vector2> finite_points_from(const char* argument, nb::handle given);
/// Numbers from anything of which NumPy makes an array of shape (n,).
std::vector<double> numbers_from(const char* argument, nb::handle given);
/// A pair of numbers.
Vector2 pair_from(const char* argument, nb::handle given);

}  // namespace sila::python
