#include "sila/model/packing.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

namespace sila {
namespace {

[[noreturn]] void reject_blob(const std::string& what) {
  throw std::invalid_argument("unpack: " + what);
}

class Packer {
 public:
  void add(double value) { numbers_.push_back(value); }
  template <class Derived>
  void add(const Eigen::PlainObjectBase<Derived>& matrix) {
    add(static_cast<double>(matrix.rows()));
    add(static_cast<double>(matrix.cols()));
    numbers_.insert(numbers_.end(), matrix.data(), matrix.data() + matrix.size());
  }
  /// Its columns one after the other, from the diagonal down.
  void add_lower_triangle(const Eigen::MatrixXd& matrix) {
    add(static_cast<double>(matrix.rows()));
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      for (Eigen::Index row = column; row < matrix.rows(); ++row) add(matrix(row, column));
    }
  }
  template <class Element, class Add>
  void add_list(const std::vector<Element>& list, Add&& add_element) {
    add(static_cast<double>(list.size()));
    for (const Element& element : list) add_element(element);
  }
  std::vector<double> numbers() && { return std::move(numbers_); }

 private:
  std::vector<double> numbers_;
};

class Unpacker {
 public:
  explicit Unpacker(std::span<const double> numbers) : rest_(numbers) {}

  double number() { return take(1).front(); }
  /// A whole number that counts something. No check against what remains: sizes of nothing may be any.
  template <class Count>
  Count count() {
    const double value = number();
    const double largest = std::min(9.0e15, static_cast<double>(std::numeric_limits<Count>::max()));
    if (!(value >= 0.0 && value <= largest) || std::trunc(value) != value || std::signbit(value))
      reject_blob(std::to_string(value) + " is no size");
    return static_cast<Count>(value);
  }
  Eigen::MatrixXd matrix() {
    const auto rows = count<Eigen::Index>();
    const auto columns = count<Eigen::Index>();
    if (rows > 0 && columns > static_cast<Eigen::Index>(rest_.size()) / rows) reject_blob("a matrix goes over the end");
    const std::span<const double> entries = take(static_cast<std::size_t>(rows * columns));
    return Eigen::Map<const Eigen::MatrixXd>(entries.data(), rows, columns);
  }
  Eigen::MatrixXd lower_triangle() {
    const auto size = count<Eigen::Index>();
    if (size > 0 && (size + 1) / 2 > static_cast<Eigen::Index>(rest_.size()) / size)
      reject_blob("a triangle goes over the end");
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
    for (Eigen::Index column = 0; column < size; ++column) {
      for (Eigen::Index row = column; row < size; ++row) matrix(row, column) = number();
    }
    return matrix;
  }
  Eigen::VectorXd vector() {
    const Eigen::MatrixXd column = matrix();
    if (column.cols() != 1) reject_blob("a vector has " + std::to_string(column.cols()) + " columns");
    return column;
  }
  template <class Element, class Read>
  std::vector<Element> list(Read&& read) {
    const auto length = count<std::size_t>();
    if (length > rest_.size()) reject_blob("a list goes over the end");  // an element has a number at least
    std::vector<Element> elements;
    elements.reserve(length);
    for (std::size_t i = 0; i < length; ++i) elements.push_back(read());
    return elements;
  }
  bool empty() const { return rest_.empty(); }
  void finish() const {
    if (!empty()) reject_blob(std::to_string(rest_.size()) + " numbers are left over");
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

/// By structured bindings here and below: a member that is added to a struct and forgotten here does not compile.
void add_gp(Packer& packer, const SparseGp& gp) {
  const auto& [kernel, noise_variance, pseudo_inputs, mean, information, response, mean_response, points, jitter] = gp;
  const auto& [signal_variance, length_scales] = kernel;
  packer.add(signal_variance);
  packer.add(length_scales);
  packer.add(noise_variance);
  packer.add(pseudo_inputs);
  packer.add(mean);
  packer.add(information);
  packer.add(response);
  packer.add(mean_response);
  packer.add(points);
  packer.add(jitter);
}

SparseGp read_gp(Unpacker& unpacker) {
  SparseGp gp;
  gp.kernel.signal_variance = unpacker.number();
  gp.kernel.length_scales = unpacker.vector();
  gp.noise_variance = unpacker.number();
  gp.pseudo_inputs = unpacker.matrix();
  gp.mean = unpacker.vector();
  gp.information = unpacker.matrix();
  gp.response = unpacker.matrix();
  gp.mean_response = unpacker.vector();
  gp.points = unpacker.number();
  gp.jitter = unpacker.number();
  return gp;
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

bool same_bits(std::span<const double> a, std::span<const double> b) {
  return std::ranges::equal(a, b, [](double x, double y) { return same_bits(x, y); });
}

bool identical(const MotionPrimitive& a, const MotionPrimitive& b) {
  const auto same_cell = [](const CellVelocity& x, const CellVelocity& y) {
    return x.cell == y.cell && same_bits(x.velocity.x(), y.velocity.x()) && same_bits(x.velocity.y(), y.velocity.y());
  };
  return same_bits(a.weight, b.weight) && a.support == b.support && std::ranges::equal(a.cells, b.cells, same_cell);
}

bool identical(const Transition& a, const Transition& b) {
  return a.from == b.from && a.to == b.to && same_bits(a.count, b.count) && same_bits(pack(a.field), pack(b.field)) &&
         same_bits(pack(a.residual), pack(b.residual)) && same_bits(pack(a.sites), pack(b.sites)) &&
         a.support == b.support;
}

bool identical(const Site& a, const Site& b) {
  return same_bits(pack(a.frame), pack(b.frame)) && a.episodes == b.episodes && a.tracks == b.tracks &&
         same_bits(pack(a.error_statistics), pack(b.error_statistics)) &&
         same_bits(pack(a.global_residual), pack(b.global_residual));
}

}  // namespace

std::vector<double> pack(const ErrorStatistics& error_statistics) {
  const auto& [steps, interval_s, observe_s, stacking, density, density_place_free, scores, novelties, slow, changes,
               correction, correction_share] = error_statistics;
  Packer packer;
  const auto add_moments = [&](const RegressionMoments& moments) {
    const auto& [weight, features, products] = moments;
    packer.add(weight);
    packer.add_lower_triangle(features);
    packer.add(products);
  };
  const auto add_errors = [&](const ErrorMoments& moments) {
    const auto& [weight, along, across] = moments;
    packer.add(weight);
    packer.add(along);
    packer.add(across);
  };
  const auto add_density = [&](const DensityMoments& moments) {
    const auto& [scale, components] = moments;
    add_moments(scale);
    packer.add_list(components, add_errors);
  };
  packer.add(steps);
  packer.add(interval_s);
  packer.add(observe_s);
  packer.add_list(stacking, add_moments);
  for (const Densities* densities : {&density, &density_place_free}) {
    for (const DensityMoments& moments : *densities) add_density(moments);
  }
  const auto add_number = [&](double number) { packer.add(number); };
  packer.add_list(scores, [&](const std::vector<double>& bins) { packer.add_list(bins, add_number); });
  packer.add_list(novelties, add_number);
  packer.add_list(slow, [&](const SlowErrors& errors) {
    const auto& [weight, errors_m] = errors;
    packer.add(weight);
    for (const double error_m : errors_m) packer.add(error_m);
  });
  for (const RegressionMoments& change : changes) add_moments(change);
  add_moments(correction);
  add_moments(correction_share);
  return std::move(packer).numbers();
}

ErrorStatistics unpack_error_statistics(std::span<const double> numbers) {
  Unpacker unpacker(numbers);
  const auto moments = [&] {  // braces: the reads happen in this order
    return RegressionMoments{unpacker.number(), unpacker.lower_triangle(), unpacker.matrix()};
  };
  const auto error_moments = [&] { return ErrorMoments{unpacker.number(), unpacker.number(), unpacker.number()}; };
  const auto density = [&] { return DensityMoments{moments(), unpacker.list<ErrorMoments>(error_moments)}; };
  ErrorStatistics error_statistics;
  error_statistics.steps = unpacker.count<int>();
  error_statistics.interval_s = unpacker.number();
  error_statistics.observe_s = unpacker.number();
  error_statistics.stacking = unpacker.list<RegressionMoments>(moments);
  for (Densities* densities : {&error_statistics.density, &error_statistics.density_place_free}) {
    for (DensityMoments& read : *densities) read = density();
  }
  const auto number = [&] { return unpacker.number(); };
  error_statistics.scores = unpacker.list<std::vector<double>>([&] { return unpacker.list<double>(number); });
  error_statistics.novelties = unpacker.list<double>(number);
  error_statistics.slow = unpacker.list<SlowErrors>([&] {
    SlowErrors errors{unpacker.number(), {}};
    for (double& error_m : errors.errors_m) error_m = unpacker.number();
    return errors;
  });
  for (RegressionMoments& change : error_statistics.changes) change = moments();
  error_statistics.correction = moments();
  error_statistics.correction_share = moments();
  unpacker.finish();
  return error_statistics;
}

std::vector<double> pack(const FlowField& field) {
  const auto& [gp, extent, gp_y] = field;
  Packer packer;
  add_gp(packer, gp);
  packer.add(extent.min());
  packer.add(extent.max());
  if (field.independent()) add_gp(packer, gp_y);
  return std::move(packer).numbers();
}

FlowField unpack_flow_field(std::span<const double> numbers) {
  Unpacker unpacker(numbers);
  const auto corner = [&] {
    const Eigen::VectorXd point = unpacker.vector();
    if (point.size() != 2) reject_blob("a corner of the extent has " + std::to_string(point.size()) + " coordinates");
    return Vector2(point);
  };
  FlowField field;
  field.gp = read_gp(unpacker);
  field.extent.min() = corner();
  field.extent.max() = corner();
  if (!unpacker.empty()) {
    field.gp_y = read_gp(unpacker);
    if (!field.independent()) reject_blob("the second GP of a field has no output");
  }
  unpacker.finish();
  return field;
}

std::vector<double> pack(const SparseGp& gp) {
  Packer packer;
  add_gp(packer, gp);
  return std::move(packer).numbers();
}

SparseGp unpack_gp(std::span<const double> numbers) {
  Unpacker unpacker(numbers);
  SparseGp gp = read_gp(unpacker);
  unpacker.finish();
  return gp;
}

std::vector<double> pack(const CurbFrame& frame) {
  const auto& [origin_m, axis_1, axis_2, unit_m, sidewalk_width_m, from_tracks] = frame;
  Packer packer;
  for (const Vector2& part : {origin_m, axis_1, axis_2, unit_m}) packer.add(part);
  packer.add(sidewalk_width_m);
  if (from_tracks) packer.add(1.0);  // left out for all others, as files had it before such frames were known
  return std::move(packer).numbers();
}

CurbFrame unpack_frame(std::span<const double> numbers) {
  Unpacker unpacker(numbers);
  const auto pair = [&] {
    const Eigen::VectorXd point = unpacker.vector();
    if (point.size() != 2) reject_blob("a frame has a point with " + std::to_string(point.size()) + " coordinates");
    return Vector2(point);
  };
  CurbFrame frame{pair(), pair(), pair(), pair(), unpacker.number()};  // braces: the reads happen in this order
  if (!unpacker.empty()) frame.from_tracks = unpacker.number() == 1.0;
  if (pack(frame).size() != numbers.size()) reject_blob("a frame ends with a mark that is not 1");
  unpacker.finish();
  return frame;
}

std::vector<double> pack(const std::vector<SiteCount>& counts) {
  Packer packer;
  packer.add_list(counts, [&](const SiteCount& part) {
    const auto& [site, count, last_episode] = part;
    packer.add(site);
    packer.add(count);
    packer.add(last_episode);
  });
  return std::move(packer).numbers();
}

std::vector<SiteCount> unpack_site_counts(std::span<const double> numbers) {
  Unpacker unpacker(numbers);
  std::vector<SiteCount> counts = unpacker.list<SiteCount>([&] {
    return SiteCount{unpacker.count<int>(), unpacker.number(), unpacker.count<int>()};
  });
  unpacker.finish();
  return counts;
}

std::vector<double> pack(const ModelSettings& settings) {
  const auto& [grid, scaling, sample_interval_s, reference_width_m, residual_horizon_s, residual_knots] = settings;
  const auto& [cell, origin, tile_cells] = grid;
  Packer packer;
  packer.add(cell);
  packer.add(origin);
  packer.add(tile_cells);
  packer.add(static_cast<double>(scaling));
  packer.add(sample_interval_s);
  packer.add(reference_width_m);
  packer.add(residual_horizon_s);
  packer.add(residual_knots);
  return std::move(packer).numbers();
}

ModelSettings unpack_settings(std::span<const double> numbers) {
  Unpacker unpacker(numbers);
  ModelSettings settings;
  settings.grid.cell = unpacker.number();
  const Eigen::VectorXd origin = unpacker.vector();
  if (origin.size() != 2) reject_blob("the grid's origin has " + std::to_string(origin.size()) + " coordinates");
  settings.grid.origin = origin;
  settings.grid.tile_cells = unpacker.count<int>();
  const int scaling = unpacker.count<int>();
  if (scaling > static_cast<int>(CurbScaling::strip_widths))
    reject_blob(std::to_string(scaling) + " is no curb scaling");
  settings.scaling = static_cast<CurbScaling>(scaling);
  settings.sample_interval_s = unpacker.number();
  settings.reference_width_m = unpacker.number();
  settings.residual_horizon_s = unpacker.number();
  settings.residual_knots = unpacker.count<int>();
  unpacker.finish();
  return settings;
}

std::size_t packed_bytes(const MotionPrimitive& primitive) {
  const auto& [cells, weight, support] = primitive;
  constexpr std::size_t per_cell = sizeof(CellKey) + sizeof(Vector2);
  return sizeof weight + sizeof support + per_cell * cells.size();
}

std::size_t packed_bytes(const Transition& transition) {
  const auto& [from, to, count, field, residual, sites, support] = transition;
  return sizeof from + sizeof to + sizeof count + sizeof support +
         sizeof(double) * (pack(field).size() + pack(residual).size() + pack(sites).size());
}

std::size_t packed_bytes(const Site& site) {
  const auto& [frame, episodes, tracks, error_statistics, global_residual] = site;
  return sizeof episodes + sizeof tracks +
         sizeof(double) * (pack(frame).size() + pack(error_statistics).size() + pack(global_residual).size());
}

std::size_t packed_bytes(const Model& model) {
  std::size_t bytes = sizeof model.episodes + sizeof model.tracks + sizeof model.sharing;
  for (const auto& part : {pack(model.settings), pack(model.global_residual)}) bytes += sizeof(double) * part.size();
  for (const Site& site : model.sites) bytes += packed_bytes(site);
  for (const MotionPrimitive& primitive : model.primitives) bytes += packed_bytes(primitive);
  for (const Transition& transition : model.transitions) bytes += packed_bytes(transition);
  return bytes;
}

bool identical(const Model& a, const Model& b) {
  const auto same = [](const auto& x, const auto& y) { return identical(x, y); };
  return same_bits(pack(a.settings), pack(b.settings)) && same_bits(pack(a.global_residual), pack(b.global_residual)) &&
         a.sharing == b.sharing && std::ranges::equal(a.sites, b.sites, same) && a.episodes == b.episodes &&
         a.tracks == b.tracks && a.episode_ids == b.episode_ids &&
         std::ranges::equal(a.primitives, b.primitives, same) && std::ranges::equal(a.transitions, b.transitions, same);
}

}  // namespace sila
