#include "text_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <nlohmann/json.hpp>
#include <system_error>

#include "sila/core/errors.hpp"

namespace sila {
namespace {

[[noreturn]] void reject_unreadable(const std::string& path, const std::string& found) {
  throw FormatError(path, 0, "a readable file", found);
}

[[noreturn]] void reject_truncated(const std::string& path) {
  throw FormatError(path, 0, "a whole gzip file", "one that is truncated or damaged");
}

std::string_view unquoted(std::string_view cell) {
  const bool quoted = cell.size() >= 2 && (cell.front() == '"' || cell.front() == '\'') && cell.back() == cell.front();
  return quoted ? cell.substr(1, cell.size() - 2) : cell;
}

}  // namespace

GzipFile::GzipFile(std::string path) : path_(std::move(path)), file_(nullptr, gzclose_r) {
  std::error_code error;
  const auto status = std::filesystem::status(path_, error);
  if (!std::filesystem::exists(status)) reject_unreadable(path_, "no such file");
  if (std::filesystem::is_directory(status)) reject_unreadable(path_, "a folder");
  errno = 0;
  file_.reset(gzopen(path_.c_str(), "rb"));
  if (!file_) reject_unreadable(path_, std::generic_category().message(errno));
  gzbuffer(file_.get(), 1U << 17);
}

std::size_t GzipFile::read(std::span<char> into) {
  errno = 0;
  const int count = gzread(file_.get(), into.data(), static_cast<unsigned>(into.size()));
  if (count == static_cast<int>(into.size())) return into.size();
  // At the end of a truncated file gzread returns what it has; only the error code tells.
  int code = Z_OK;
  gzerror(file_.get(), &code);
  if (code == Z_ERRNO) reject_unreadable(path_, std::generic_category().message(errno));
  if (count < 0 || (code != Z_OK && code != Z_STREAM_END)) reject_truncated(path_);
  return static_cast<std::size_t>(count);
}

void GzipFile::seek(std::size_t offset) {
  if (gzseek(file_.get(), static_cast<z_off_t>(offset), SEEK_SET) < 0) reject_truncated(path_);
}

void reject_binary(const std::string& path, std::string_view bytes) {
  if (bytes.starts_with("\x1f\x8b")) reject_truncated(path);  // a gzip header too short for zlib to see as one
  if (bytes.starts_with("BZh") && bytes.find("1AY&SY") == 4)
    throw FormatError(path, 0, "a text file", "a bzip2 file; unpack it with bunzip2 first");
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff"))
    throw FormatError(path, 0, "a text file in UTF-8", "one in UTF-16; save it as UTF-8");
  if (bytes.find('\n') == std::string_view::npos && bytes.find('\r') != std::string_view::npos)
    throw FormatError(path, 0, "lines that end with LF or CRLF", "line ends of CR alone; save it with others");
  const std::size_t zero = bytes.find('\0');
  if (zero == std::string_view::npos) return;
  throw FormatError(path, 0, "a text file", "binary data (a zero byte at offset " + std::to_string(zero) + ")");
}

std::string read_text(const std::filesystem::path& path, const std::string& content) {
  GzipFile file(path.string());
  std::string bytes;
  std::vector<char> chunk(1U << 18);
  for (std::size_t count = chunk.size(); count == chunk.size();) {
    count = file.read(chunk);
    bytes.append(chunk.data(), count);
  }
  return text_of_bytes(path.string(), std::move(bytes), content);
}

std::string text_of_bytes(const std::string& path, std::string bytes, const std::string& content) {
  reject_binary(path, bytes);
  if (bytes.starts_with(kByteOrderMark)) bytes.erase(0, kByteOrderMark.size());
  if (trimmed(bytes).empty()) throw FormatError(path, 0, content, "an empty file");
  return bytes;
}

std::vector<TextLine> lines_of(std::string_view text, std::size_t first_number) {
  std::vector<TextLine> lines;
  lines.reserve(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1);
  std::size_t number = first_number;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    // Only the line end is cut: in a file separated by tabs a leading tab is an empty cell.
    std::string_view line = text.substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (!trimmed(line).empty()) lines.push_back({line, number});
    begin = end + 1;
  }
  return lines;
}

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> cells_of(std::string_view line, char separator) {
  const bool runs = separator == ' ';
  const auto separates = [&](char c) { return runs ? c == ' ' || c == '\t' || c == ',' : c == separator; };
  std::vector<std::string_view> cells;
  cells.reserve(12);
  std::size_t begin = 0;
  bool quoted = false;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    while (!runs && i < line.size() && line[i] != separator && line[i] != '"') ++i;  // most characters
    if (i < line.size() && line[i] == '"') quoted = !quoted;
    if (i < line.size() && (quoted || !separates(line[i]))) continue;
    const std::string_view cell = trimmed(line.substr(begin, i - begin));
    if (!runs || !cell.empty()) cells.push_back(unquoted(cell));
    begin = i + 1;
  }
  return cells;
}

std::optional<double> number_of(std::string_view cell) {
  if (!cell.empty() && cell.front() == '+') cell.remove_prefix(1);
  double value = 0.0;
  const char* end = cell.data() + cell.size();
  const auto [stop, error] = std::from_chars(cell.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

std::string utf8_of(std::string_view id) {
  const auto is_high = [](char c) { return static_cast<unsigned char>(c) >= 0x80; };
  std::string text(id);
  if (std::ranges::none_of(id, is_high)) return text;
  try {
    static_cast<void>(nlohmann::json(text).dump());
    return text;
  } catch (const nlohmann::json::type_error&) {  // is not UTF-8
    text.clear();
  }
  for (const char c : id) {
    const auto code = static_cast<unsigned char>(c);
    if (is_high(c)) text += static_cast<char>(0xc0 | (code >> 6));
    text += is_high(c) ? static_cast<char>(0x80 | (code & 0x3f)) : c;
  }
  return text;
}

std::string excerpt(std::string_view text) {
  constexpr std::size_t longest = 60;
  if (text.size() > 1 && text.starts_with('"') && text.ends_with('"')) text = text.substr(1, text.size() - 2);
  std::string shown(text.substr(0, longest));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = c == '\t' ? ' ' : '?';
  }
  return '"' + shown + (text.size() > longest ? "...\"" : "\"");
}

std::string exact(double value) {
  std::array<char, 32> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return error == std::errc() ? std::string(buffer.data(), end) : std::string("nan");
}

}  // namespace sila
