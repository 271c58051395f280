#include "read_rows.hpp"

#include <chrono>
#include <cmath>
#include <limits>

#include "core/dropped_rows.hpp"

namespace sila {
namespace {

constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();

/// The number of `digits` digits at an offset of a text; -1 for any other text.
int digits_at(std::string_view text, std::size_t at, std::size_t digits) {
  if (at + digits > text.size()) return -1;
  int value = 0;
  for (const char c : text.substr(at, digits)) {
    if (c < '0' || c > '9') return -1;
    value = 10 * value + (c - '0');
  }
  return value;
}

/// The seconds of an offset from UTC, `+02:00` or `+02`; 0 for none or Z; null for any other text.
std::optional<double> offset_s(std::string_view text) {
  if (text.empty() || text == "Z") return 0.0;
  const int hours = digits_at(text, 1, 2);
  const int minutes = text.size() == 3 ? 0 : digits_at(text, text.find(':') == 3 ? 4 : 3, 2);
  if ((text[0] != '+' && text[0] != '-') || text.size() > 6 || hours < 0 || minutes < 0) return std::nullopt;
  return (text[0] == '-' ? -60.0 : 60.0) * (60 * hours + minutes);
}

/// Seconds since 1970 of an ISO 8601 date, `2024-05-03T12:00:00.25Z`: with a blank for the T, a fraction, an offset
/// such as +02:00 or none (UTC). Null for any other text.
std::optional<double> seconds_of_date(std::string_view text) {
  if (text.size() < 19 || text[4] != '-' || text[7] != '-' || (text[10] != 'T' && text[10] != ' ') || text[13] != ':' ||
      text[16] != ':')
    return std::nullopt;
  const int year = digits_at(text, 0, 4), month = digits_at(text, 5, 2), day = digits_at(text, 8, 2);
  const int hour = digits_at(text, 11, 2), minute = digits_at(text, 14, 2), second = digits_at(text, 17, 2);
  const std::chrono::year_month_day date(std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (year < 0 || !date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60)
    return std::nullopt;
  const std::size_t end = std::min(text.find_first_of("Z+-", 19), text.size());
  const auto fraction_s = end == 19 ? std::optional(0.0) : number_of("0" + std::string(text.substr(19, end - 19)));
  const auto offset = offset_s(text.substr(end));
  if (!fraction_s || !offset || (end > 19 && text[19] != '.')) return std::nullopt;
  const double days = static_cast<double>(std::chrono::sys_days(date).time_since_epoch().count());
  return 86400.0 * days + 3600.0 * hour + 60.0 * minute + second - *offset + *fraction_s;
}

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
