#include "read_rows.hpp"

#include <cmath>
#include <limits>

#include "core/dropped_rows.hpp"
#include "table_reader.hpp"

namespace sila {
namespace {

constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();

struct Fault {
  DropReason reason;
  std::string_view found;
};

/// Reads the cells of one row; keeps the first fault instead of throwing.
class RowReader {
 public:
  /// `named`: the number of cells of the header.
  RowReader(const std::vector<std::string_view>& cells, const TrackColumns& columns, std::size_t named)
      : cells_(cells), columns_(columns) {
    if (cells.size() < columns.cells) fault_ = Fault{DropReason::missing_cells, {}};
    if (cells.size() > named && !cells.back().empty()) fault_ = Fault{DropReason::extra_cells, {}};
  }

  double number(TrackColumns::Column column) {
    if (!fault_ && !in_row(column)) fault_ = Fault{DropReason::missing_cells, {}};
    if (fault_) return 0.0;
    const auto value = number_of(cells_[*column]);
    if (!value) fault_ = Fault{DropReason::not_a_number, cells_[*column]};
    return value.value_or(0.0);
  }

  /// The point, or of a box its foot or its centre. Units: those of the file.
  Vector2 position() {
    const Vector2 corner(number(columns_.x), number(columns_.y));
    Vector2 size = Vector2::Zero();
    if (columns_.width) {
      size = Vector2(number(columns_.width), number(columns_.height));
    } else if (columns_.x2) {
      size = Vector2(number(columns_.x2), number(columns_.y2)) - corner;
    } else {
      return corner;
    }
    if (!fault_ && columns_.foot && (size.x() <= 0.0 || size.y() <= 0.0)) fault_ = Fault{DropReason::bad_box, {}};
    return corner + Vector2(0.5 * size.x(), columns_.foot ? size.y() : 0.5 * size.y());
  }

  double stamp() {
    if (!columns_.time) return number(columns_.frame);
    const auto date_s = in_row(columns_.time) ? seconds_of_date(cells_[*columns_.time]) : std::nullopt;
    if (date_s && !fault_) return *date_s;
    const double nanoseconds = columns_.nanoseconds ? number(columns_.nanoseconds) : 0.0;
    return number(columns_.time) * columns_.seconds_per_time + 1e-9 * nanoseconds;
  }

  std::string track(const std::string& only_track) {
    if (fault_) return {};
    if (!columns_.id) return only_track;
    const std::string_view cell = cells_[*columns_.id];
    if (cell.empty()) fault_ = Fault{DropReason::missing_cells, "an empty track id"};
    const bool boxes = columns_.format == TrackFormat::mot || columns_.format == TrackFormat::boxes;
    if (boxes && cell.starts_with('-') && number_of(cell)) fault_ = Fault{DropReason::missing_cells, "the track id -1"};
    if (!columns_.numeric_ids) return utf8_of(cell);
    const double value = number(columns_.id);
    return std::abs(value) < 1e15 && value == std::floor(value) ? std::to_string(static_cast<long long>(value))
                                                                : std::string(cell);
  }

  std::string label() const { return in_row(columns_.label) ? utf8_of(cells_[*columns_.label]) : std::string(); }

  void reject_lost() {
    const bool lost = (columns_.format == TrackFormat::kitti && number(columns_.x) == kUnknownKittiPlace_m) ||
                      (columns_.lost && number(columns_.lost) != 0.0) ||
                      (columns_.considered && number(columns_.considered) == 0.0);
    if (lost && !fault_) fault_ = Fault{DropReason::lost, {}};
  }

  const std::optional<Fault>& fault() const { return fault_; }

 private:
  bool in_row(TrackColumns::Column column) const { return column && *column < cells_.size(); }

  const std::vector<std::string_view>& cells_;
  const TrackColumns& columns_;
  std::optional<Fault> fault_;
};

}  // namespace

void count_bad(Detections& detections, DropReason reason, const TextLine& found) {
  DroppedRows& entry = entry_of(detections.dropped, reason);
  if (entry.rows++ > 0) return;
  entry.first = detections.source + ":" + std::to_string(found.number);
  if (!found.text.empty()) entry.first += ", found " + excerpt(found.text);
  const bool decimal_comma = found.text.find_first_not_of("+-0123456789eE,") == std::string_view::npos;
  if (reason == DropReason::not_a_number && decimal_comma && std::ranges::count(found.text, ',') == 1)
    entry.first += "; numbers need a decimal point";
}

Detections read_rows(const TextTable& table, const TrackColumns& columns, const std::string& only_track) {
  Detections result{table.path, {}};
  result.rows.reserve(table.rows.size());
  const std::size_t named = columns.header ? cells_of(table.rows.front().text, columns.separator).size() : kAnyNumber;
  for (std::size_t i = columns.header ? 1 : 0; i < table.rows.size(); ++i) {
    const TextLine& line = table.rows[i];
    const auto cells = cells_of(line.text, columns.separator);
    RowReader row(cells, columns, named);
    Detection detection;
    detection.track = row.track(only_track);
    detection.t_s = row.stamp();
    detection.position_m = row.position();
    detection.label = row.label();
    detection.line = line.number;
    row.reject_lost();
    ++result.rows_read;
    if (row.fault()) {
      const auto [reason, found] = *row.fault();
      count_bad(result, reason, {found.empty() ? line.text : found, line.number});
    } else {
      result.rows.push_back(std::move(detection));
    }
  }
  return result;
}

}  // namespace sila
