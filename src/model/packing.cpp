#include "sila/model/packing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <type_traits>

#include "core/concatenate.hpp"
#include "model/model_parts.hpp"
#include "model/parts.hpp"
#include "sila/core/fields.hpp"

namespace sila {
namespace {

[[noreturn]] void reject_blob(const auto&... parts) {
  throw invalid_argument("unpack: ", parts...);
}

// An archive is a Packer or an Unpacker; one function for both gives the members of a struct in their order, by
// structured bindings: a member that is added to a struct and forgotten here does not compile.

class Packer {
 public:
  void number(double value) { numbers_.push_back(value); }
  void count(const auto& value) { number(static_cast<double>(value)); }
  void matrix(const auto& matrix) {
    count(matrix.rows());
    count(matrix.cols());
    numbers_.insert(numbers_.end(), matrix.data(), matrix.data() + matrix.size());
  }
  /// Its columns one after the other, from the diagonal down.
  void lower_triangle(const Eigen::MatrixXd& matrix) {
    count(matrix.rows());
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      numbers_.insert(numbers_.end(), &matrix(column, column), matrix.data() + (column + 1) * matrix.rows());
  }
  void symmetric(const Eigen::MatrixXd& matrix) { lower_triangle(matrix); }
  void list(const auto& elements) {
    count(elements.size());
    for (const auto& element : elements) members(*this, element);
  }
  void choice(const auto& value, std::size_t) { count(value); }
  /// Of a part that may be left out at the end.
  bool has(bool present) const { return present; }
  void require(bool, const char*) const {}
  std::vector<double> numbers() && { return std::move(numbers_); }

 private:
  std::vector<double> numbers_;
};

class Unpacker {
 public:
  explicit Unpacker(std::span<const double> numbers) : rest_(numbers) {}

  void number(double& value) { value = take(1).front(); }
  /// A whole number that counts something. Not checked against the remaining numbers: an empty matrix may have any
  /// number of rows or columns.
  template <class Count>
  void count(Count& result) {
    double value = 0.0;
    number(value);
    const double largest = std::min(9.0e15, static_cast<double>(std::numeric_limits<Count>::max()));
    if (!(value >= 0.0 && value <= largest) || std::trunc(value) != value || std::signbit(value))
      reject_blob(value, " is no size");
    result = static_cast<Count>(value);
  }
  template <class Derived>
  void matrix(Eigen::PlainObjectBase<Derived>& result) {
    constexpr Eigen::Index fixed_rows = Derived::RowsAtCompileTime, fixed_columns = Derived::ColsAtCompileTime;
    Eigen::Index rows = 0, columns = 0;
    count(rows);
    count(columns);
    if (rows > 0 && columns > static_cast<Eigen::Index>(rest_.size()) / rows) reject_blob("a matrix goes over the end");
    if (fixed_columns == 1 && columns != 1) reject_blob("a vector has ", columns, " columns");
    if (fixed_rows != Eigen::Dynamic && rows != fixed_rows) reject_blob("a point has ", rows, " coordinates");
    const std::span<const double> entries = take(static_cast<std::size_t>(rows * columns));
    result.derived() = Eigen::Map<const Eigen::MatrixXd>(entries.data(), rows, columns);
  }
  void lower_triangle(Eigen::MatrixXd& matrix) {
    Eigen::Index size = 0;
    count(size);
    if (size > 0 && (size + 1) / 2 > static_cast<Eigen::Index>(rest_.size()) / size)
      reject_blob("a triangle goes over the end");
    matrix.setZero(size, size);
    for (Eigen::Index column = 0; column < size; ++column)
      std::ranges::copy(take(static_cast<std::size_t>(size - column)), &matrix(column, column));
  }
  void symmetric(Eigen::MatrixXd& matrix) {
    lower_triangle(matrix);
    matrix.triangularView<Eigen::StrictlyUpper>() = matrix.transpose();
  }
  void list(auto& elements) {
    std::size_t length = 0;
    count(length);
    if (length > rest_.size()) reject_blob("a list goes over the end");  // an element has a number at least
    elements.resize(length);
    for (auto& element : elements) members(*this, element);
  }
  template <class Choice>
  void choice(Choice& value, std::size_t choices) {
    std::size_t number = 0;
    count(number);
    if (number >= choices) reject_blob(number, " is none of ", choices, " choices");
    value = static_cast<Choice>(number);
  }
  bool has(bool) const { return !rest_.empty(); }
  void require(bool holds, const char* what) const {
    if (!holds) reject_blob(what);
  }
  void finish() const {
    if (!rest_.empty()) reject_blob(rest_.size(), " numbers are left over");
  }

 private:
  std::span<const double> take(std::size_t length) {
    if (length > rest_.size()) reject_blob("the numbers end too early");
    const std::span<const double> taken = rest_.first(length);
    rest_ = rest_.subspan(length);
    return taken;
  }

  std::span<const double> rest_;
};

/// Numbers and sums: a struct part by part, a list with its length, an array without.
void members(auto& archive, auto& sums) {
  if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(sums)>>) {
    archive.number(sums);
  } else if constexpr (requires { parts_of(sums); }) {
    std::apply([&](auto&... parts) { (members(archive, parts), ...); }, parts_of(sums));
  } else if constexpr (requires { sums.capacity(); }) {
    archive.list(sums);
  } else {
    for (auto& entry : sums) members(archive, entry);
  }
}

void members(auto& archive, MaybeConst<RegressionMoments> auto& moments) {
  auto& [weight, features, products] = moments;
  archive.number(weight);
  archive.lower_triangle(features);
  archive.matrix(products);
}

void members(auto& archive, MaybeConst<ErrorStatistics> auto& error_statistics) {
  archive.count(error_statistics.steps);
  archive.number(error_statistics.interval_s);
  archive.number(error_statistics.observe_s);
  std::apply([&](auto&... parts) { (members(archive, parts), ...); }, parts_of(error_statistics));
}

void members(auto& archive, MaybeConst<SparseGp> auto& gp) {
  auto& [kernel, noise_variance, pseudo_inputs, mean, information, response, mean_response, points, jitter] = gp;
  auto& [signal_variance, length_scales] = kernel;
  archive.number(signal_variance);
  archive.matrix(length_scales);
  archive.number(noise_variance);
  archive.matrix(pseudo_inputs);
  archive.matrix(mean);
  archive.symmetric(information);
  archive.matrix(response);
  archive.matrix(mean_response);
  archive.number(points);
  archive.number(jitter);
}

void members(auto& archive, MaybeConst<FlowField> auto& field) {
  auto& [gp, extent, gp_y] = field;
  members(archive, gp);
  archive.matrix(extent.min());
  archive.matrix(extent.max());
  if (!archive.has(field.independent())) return;
  members(archive, gp_y);
  archive.require(field.independent(), "the second GP of a field has no output");
}

void members(auto& archive, MaybeConst<CurbFrame> auto& frame) {
  auto& [origin_m, axis_1, axis_2, unit_m, sidewalk_width_m, from_tracks] = frame;
  for (auto* part : {&origin_m, &axis_1, &axis_2, &unit_m}) archive.matrix(*part);
  archive.number(sidewalk_width_m);
  if (!archive.has(from_tracks)) return;  // left out for all others, as files had it before such frames were known
  archive.choice(from_tracks, 2);
  archive.require(from_tracks, "a frame ends with a mark that is not 1");
}

void members(auto& archive, MaybeConst<SiteCount> auto& part) {
  auto& [site, count, last_episode] = part;
  archive.count(site);
  archive.number(count);
  archive.count(last_episode);
}

void members(auto& archive, MaybeConst<AllSettings> auto& settings) {
  auto& [grid, scaling, sample_interval_s, reference_width_m] = settings.first;
  auto& [horizon_s, knots] = settings.second;
  auto& [cell, origin, tile_cells] = grid;
  archive.number(cell);
  archive.matrix(origin);
  archive.count(tile_cells);
  archive.choice(scaling, kCurbScalings.size());
  archive.number(sample_interval_s);
  archive.number(reference_width_m);
  archive.number(horizon_s);
  archive.count(knots);
}

}  // namespace

template <PackedPart Part>
std::vector<double> pack(const Part& part) {
  Packer packer;
  members(packer, part);
  return std::move(packer).numbers();
}

template <PackedPart Part>
Part unpack(std::span<const double> numbers) {
  Unpacker unpacker(numbers);
  Part part;
  members(unpacker, part);
  unpacker.finish();
  return part;
}

template std::vector<double> pack(const ErrorStatistics&);
template std::vector<double> pack(const FlowField&);
template std::vector<double> pack(const SparseGp&);
template std::vector<double> pack(const CurbFrame&);
template std::vector<double> pack(const std::vector<SiteCount>&);
template std::vector<double> pack(const AllSettings&);
template ErrorStatistics unpack(std::span<const double>);
template FlowField unpack(std::span<const double>);
template SparseGp unpack(std::span<const double>);
template CurbFrame unpack(std::span<const double>);
template std::vector<SiteCount> unpack(std::span<const double>);
template AllSettings unpack(std::span<const double>);

std::size_t packed_bytes(const MotionPrimitive& primitive) {
  const auto& [cells, weight, support] = primitive;
  constexpr std::size_t per_cell = sizeof(CellKey) + sizeof(Vector2);
  return sizeof weight + sizeof support + per_cell * cells.size();
}

std::size_t packed_bytes(const Transition& transition, const SparseGp& residual) {
  const auto& [from, to, count, field, sites, support] = transition;
  return sizeof from + sizeof to + sizeof count + sizeof support +
         sizeof(double) * (pack(field).size() + pack(residual).size() + pack(sites).size());
}

std::size_t packed_bytes(const Model& model) {
  const auto& [residual_settings, residuals, error_statistics, prior] = model.refinement;
  std::size_t bytes = sizeof model.episodes + sizeof model.tracks + sizeof model.sharing;
  std::size_t numbers = pack(AllSettings{model.settings, residual_settings}).size();
  numbers += pack(prior).size();
  for (std::size_t i = 0; i < model.sites.size(); ++i) {
    const auto& [frame, episodes, tracks] = model.sites[i];
    bytes += sizeof episodes + sizeof tracks;
    numbers += pack(frame).size() + pack(entry_of(error_statistics, i)).size();
  }
  for (const MotionPrimitive& primitive : model.primitives) bytes += packed_bytes(primitive);
  for (std::size_t i = 0; i < model.transitions.size(); ++i)
    bytes += packed_bytes(model.transitions[i], entry_of(residuals, i));
  return bytes + sizeof(double) * numbers;
}

bool identical(const Model& a, const Model& b) {
  return parts_of(a, {}) == parts_of(b, {});
}

}  // namespace sila
