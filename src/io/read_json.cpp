#include <algorithm>
#include <nlohmann/json.hpp>

#include "read_rows.hpp"
#include "sila/core/errors.hpp"
#include "table_reader.hpp"

namespace sila {
namespace {

/// The elements of a JSON array, each with the line on which it begins. Throws: FormatError if the array does not end,
/// or ends before the text.
std::vector<TextLine> elements_of(const std::string& path, std::string_view text) {
  std::vector<TextLine> elements;
  std::size_t line = 1, begin = 0, begin_line = 0, depth = 0;  // begin_line 0: only blanks since `begin`
  bool quoted = false;
  const auto end_element = [&](std::size_t end) {
    if (begin_line > 0) elements.push_back({trimmed(text.substr(begin, end - begin)), begin_line});
    begin = end + 1;
    begin_line = 0;
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    const bool ends = !quoted && ((c == ',' && depth == 1) || ((c == ']' || c == '}') && --depth == 0));
    if (ends) {
      end_element(i);
    } else if (depth > 0 && begin_line == 0 && !trimmed(text.substr(i, 1)).empty()) {
      begin_line = line;
    }
    if (ends && depth == 0) {
      const std::string_view rest = trimmed(text.substr(c == ']' ? i + 1 : i));
      if (rest.empty()) return elements;
      throw FormatError(path, line, "the end of the file after a JSON array", excerpt(rest));
    }
    if (quoted && c == '\\') ++i;
    if (c == '"') quoted = !quoted;
    if (!quoted && (c == '[' || c == '{') && ++depth == 1) begin = i + 1;
  }
  throw FormatError(path, line, "a JSON array that is whole", "the end of the file");
}

/// A value as the cell of a table; arrays, objects and null are empty.
std::string json_cell(const nlohmann::json& value) {
  if (value.is_number() || value.is_boolean()) return value.dump();
  std::string text = value.is_string() ? value.get<std::string>() : std::string();
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == '"'; }, ' ');
  return text;
}

}  // namespace

bool is_json_array(std::string_view text) {
  return trimmed(text.substr(0, std::min<std::size_t>(text.size(), 4096))).starts_with('[');
}

TrackFile read_json_array(const std::string& path, std::string_view text, const ReadOptions& options,
                          const std::string& only_track) {
  std::vector<std::string> names;
  std::vector<std::size_t> lines;
  std::string rows;
  BadRows bad;
  std::size_t bad_rows = 0;
  for (const TextLine& element : elements_of(path, text)) {
    const auto object = nlohmann::json::parse(element.text, nullptr, false);
    if (!object.is_object()) {
      bad.count(DropReason::not_json, path, element.number, element.text);
      ++bad_rows;
      continue;
    }
    if (lines.empty()) {
      rows = "object";
      for (const auto& [name, value] : object.items()) rows += '\t' + json_cell(names.emplace_back(name));
      std::ranges::replace_if(
          rows, [](char c) { return c == ',' || c == ';'; }, ' ');  // tabs separate
      lines.push_back(element.number);
    }
    rows += "\n0";  // neither blank nor a comment, whatever the first value is
    for (const std::string& name : names) rows += '\t' + json_cell(object.value(name, nlohmann::json()));
    lines.push_back(element.number);
  }
  if (lines.empty()) throw FormatError(path, 1, "a JSON array of objects, one a detection", "none");
  TextTable table{path, lines_of(rows), {}};
  for (std::size_t i = 0; i < lines.size(); ++i) table.rows[i].number = lines[i];
  const auto reader = table_reader(table, options);
  if (!reader)
    throw FormatError(path, 1, std::string("lines of format ") + std::string(name_of(*options.format)), "a JSON array");
  TrackFile file = read_table(table, *reader, only_track);
  file.detections.rows_read += bad_rows;
  for (DroppedRows& entry : bad.by_reason()) file.detections.dropped.push_back(std::move(entry));
  return file;
}

}  // namespace sila
