#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/io/files.hpp"

namespace sila {

/// JSON is copied and printed by recursion: deeper nesting could exhaust the stack.
inline constexpr std::size_t kDeepestJson = 100;

/// The JSON of a text; discarded if it is none, or nested deeper than kDeepestJson.
nlohmann::json shallow_json(std::string_view text);

/// A member of an object; null if it is not there, or for another value than an object.
const nlohmann::json& member(const nlohmann::json& object, const char* key);

/// One line; bytes that are not UTF-8, such as those of a track id, are replaced.
std::string one_line(const nlohmann::ordered_json& json);

/// As read_json, for the text of a file; `path` is for messages.
nlohmann::json json_of_text(const std::string& path, const std::string& text);

/// Typed access to the fields of one JSON object of a file; every error names the file, the field, what was expected
/// and found.
class JsonFields {
 public:
  /// `where` is the path of the object inside the file, such as "files[2]."; empty for the outermost.
  JsonFields(const nlohmann::json& object, std::string file, std::string where);

  bool has(const char* key) const;  ///< present and not null
  double number(const char* key) const;
  double positive(const char* key) const;
  int whole(const char* key) const;
  bool flag(const char* key) const;
  std::string text(const char* key) const;
  Vector2 point(const char* key) const;
  JsonFields object(const char* key) const;
  std::vector<JsonFields> objects(const char* key) const;  ///< the objects of an array; empty if the key is absent
  std::vector<std::string> texts(const char* key) const;   ///< of an array of texts; empty if the key is absent
  /// Rows of this number of finite numbers; `expected` describes them.
  std::vector<std::vector<double>> rows(const char* key, std::size_t columns, const std::string& expected) const;

  double number_or(const char* key, double otherwise) const { return has(key) ? number(key) : otherwise; }
  bool flag_or(const char* key, bool otherwise) const { return has(key) ? flag(key) : otherwise; }
  std::string text_or(const char* key, const std::string& otherwise) const { return has(key) ? text(key) : otherwise; }
  std::optional<double> optional_positive(const char* key) const {
    return has(key) ? std::optional(positive(key)) : std::nullopt;
  }

  [[noreturn]] void reject(const std::string& key, const std::string& expected) const;
  const std::string& where() const { return where_; }

 private:
  const nlohmann::json& at(const char* key, const std::string& expected,
                           const std::function<bool(const nlohmann::json&)>& fits) const;

  const nlohmann::json* object_;
  std::string file_;
  std::string where_;
};

}  // namespace sila
