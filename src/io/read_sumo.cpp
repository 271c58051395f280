#include <expat.h>

#include <algorithm>
#include <memory>
#include <type_traits>

#include "read_rows.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace {

struct Reading {
  std::string_view text;
  XML_Parser parser = nullptr;
  std::size_t line = 1, counted_bytes = 0;  ///< of the text before the last place that was asked for
  Detections detections;
  double t_s = 0.0;
  bool timed = false;  ///< the time of this step is a number
  bool begun = false;
  std::string other_root;  ///< the outermost element if it is another one
};

/// The line of the parser's place, by line feeds as in every other format; Expat counts a lone carriage return, too.
std::size_t present_line(Reading& reading) {
  const auto place = static_cast<std::size_t>(std::max<XML_Index>(XML_GetCurrentByteIndex(reading.parser), 0));
  const std::size_t end = std::clamp(place, reading.counted_bytes, reading.text.size());
  const std::string_view passed = reading.text.substr(reading.counted_bytes, end - reading.counted_bytes);
  reading.line += static_cast<std::size_t>(std::ranges::count(passed, '\n'));
  reading.counted_bytes = end;
  return reading.line;
}

/// The value of an attribute; null if there is none. `attributes`: names and values in turn, then null.
const char* attribute(const XML_Char** attributes, std::string_view name) {
  for (; *attributes != nullptr; attributes += 2) {
    if (*attributes == name) return attributes[1];
  }
  return nullptr;
}

std::optional<double> number(const XML_Char** attributes, std::string_view name) {
  const char* const text = attribute(attributes, name);
  return text == nullptr ? std::nullopt : number_of(text);
}

void begin_element(void* data, const XML_Char* element, const XML_Char** attributes) {
  Reading& reading = *static_cast<Reading*>(data);
  const std::string_view name = element;
  if (!reading.begun && name != "fcd-export") reading.other_root = name;
  reading.begun = true;
  if (name == "timestep") {
    const auto t_s = number(attributes, "time");
    reading.timed = t_s.has_value();
    reading.t_s = t_s.value_or(0.0);
  }
  if (name != "person" && name != "vehicle") return;
  ++reading.detections.rows_read;
  const std::size_t line = present_line(reading);
  const char* const id = attribute(attributes, "id");
  const auto x_m = number(attributes, "x"), y_m = number(attributes, "y");
  if (id == nullptr || *id == '\0') {
    count_bad(reading.detections, DropReason::missing_cells, {element, line});
  } else if (!reading.timed || !x_m || !y_m) {
    count_bad(reading.detections, DropReason::not_a_number, {id, line});
  } else {
    const char* const vehicle = attribute(attributes, "vehicle");
    const bool rides = vehicle != nullptr && *vehicle != '\0';
    reading.detections.rows.push_back({id, reading.t_s, {*x_m, *y_m}, rides ? "passenger" : element, line});
  }
}

}  // namespace

bool is_xml(std::string_view text) {
  return trimmed(text.substr(0, 4096)).starts_with('<');
}

TrackFile read_sumo_fcd(const std::string& path, std::string_view text) {
  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, decltype(&XML_ParserFree)> parser(XML_ParserCreate(nullptr),
                                                                                             &XML_ParserFree);
  Reading reading;
  reading.detections.source = path;
  reading.text = text;
  reading.parser = parser.get();
  XML_SetUserData(parser.get(), &reading);
  XML_SetStartElementHandler(parser.get(), begin_element);
  constexpr std::size_t kBlock = 1U << 20;
  for (std::size_t at = 0; at < text.size(); at += kBlock) {
    const std::string_view block = text.substr(at, kBlock);
    const bool last = at + kBlock >= text.size();
    if (XML_Parse(parser.get(), block.data(), static_cast<int>(block.size()), last) == XML_STATUS_ERROR) {
      throw FormatError(path, present_line(reading), "XML that is whole and well-formed",
                        XML_ErrorString(XML_GetErrorCode(parser.get())));
    }
  }
  if (!reading.begun || !reading.other_root.empty())
    throw FormatError(path, 1, "XML of SUMO whose outermost element is fcd-export", excerpt(reading.other_root));
  return {std::move(reading.detections), TrackFormat::sumo_fcd};
}

}  // namespace sila
