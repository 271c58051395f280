#include "clock.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <unordered_map>

#include "sila/core/errors.hpp"
#include "text_file.hpp"

namespace sila {
namespace {

/// The commonest positive step from one frame of a person to the next; the smallest of equals, 1 if there is none.
double common_step(const std::vector<Detection>& rows) {
  std::unordered_map<std::string_view, std::vector<double>> frames;
  for (const Detection& row : rows) {
    if (std::isfinite(row.t_s)) frames[row.track].push_back(row.t_s);
  }
  std::map<double, std::size_t> counts;
  for (auto& [track, stamps] : frames) {
    std::sort(stamps.begin(), stamps.end());
    for (std::size_t i = 1; i < stamps.size(); ++i) {
      if (stamps[i] > stamps[i - 1]) ++counts[stamps[i] - stamps[i - 1]];
    }
  }
  double best = 1.0;
  std::size_t most = 0;
  for (const auto& [step, count] : counts) {
    if (count <= most) continue;
    best = step;
    most = count;
  }
  return best;
}

TrackFile at_rate(TrackFile file, double frames_per_second) {
  for (Detection& row : file.detections.rows) row.t_s /= frames_per_second;
  file.clock = "frames, " + exact(frames_per_second) + " per second";
  return file;
}

TrackFile at_interval(TrackFile file, double interval_s) {
  const double step = common_step(file.detections.rows);
  for (Detection& row : file.detections.rows) row.t_s = row.t_s / step * interval_s;
  file.clock = "frames, " + exact(interval_s) + " s for each step of " + exact(step);
  return file;
}

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

/// The seconds of an offset from UTC, `+02:00`; 0 for none or Z; null for any other text.
std::optional<double> offset_s(std::string_view text) {
  if (text.empty() || text == "Z") return 0.0;
  const int hours = digits_at(text, 1, 2), minutes = digits_at(text, text.find(':') == 3 ? 4 : 3, 2);
  if ((text[0] != '+' && text[0] != '-') || text.size() > 6 || hours < 0 || minutes < 0) return std::nullopt;
  return (text[0] == '-' ? -60.0 : 60.0) * (60 * hours + minutes);
}

}  // namespace

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

TrackFile with_seconds(TrackFile frames, const ReadOptions& options, const FrameClock& of_format) {
  if (options.frames_per_second) return at_rate(std::move(frames), *options.frames_per_second);
  if (options.sample_interval_s) return at_interval(std::move(frames), *options.sample_interval_s);
  if (of_format.frames_per_second) return at_rate(std::move(frames), *of_format.frames_per_second);
  if (of_format.sample_interval_s) return at_interval(std::move(frames), *of_format.sample_interval_s);
  throw FormatError(frames.detections.source, 0, "time stamps, or a frame rate (frames_per_second, --fps)",
                    "frame numbers alone");
}

}  // namespace sila
