#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/concatenate.hpp"

/// Numbers as bytes, little endian on every machine.
namespace sila::bytes {

static_assert(std::endian::native == std::endian::little);

template <std::unsigned_integral Word>
void append(std::string& bytes, Word word) {
  for (std::size_t i = 0; i < sizeof(Word); ++i) bytes.push_back(static_cast<char>((word >> (8 * i)) & 0xffU));
}
inline void append(std::string& bytes, std::int64_t number) {
  append(bytes, static_cast<std::uint64_t>(number));
}
inline void append(std::string& bytes, double number) {
  append(bytes, std::bit_cast<std::uint64_t>(number));
}
/// Appends the length of a text, then the text.
inline void append_text(std::string& bytes, std::string_view text) {
  append(bytes, std::uint64_t{text.size()});
  bytes += text;
}

template <std::unsigned_integral Word>
Word word_at(const char* bytes) {
  Word word = 0;
  std::memcpy(&word, bytes, sizeof(Word));
  return word;
}

/// Numbers as words of this size. Throws: std::invalid_argument unless the bytes are whole words.
template <std::unsigned_integral Word, class Number = Word>
std::vector<Number> words(std::string_view bytes) {
  if (bytes.size() % sizeof(Word) != 0)
    throw invalid_argument("a blob has ", bytes.size(), " bytes, no multiple of ", sizeof(Word));
  std::vector<Number> result(bytes.size() / sizeof(Word));
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = std::bit_cast<Number>(word_at<Word>(bytes.data() + i * sizeof(Word)));
  return result;
}

inline std::string of_numbers(std::span<const double> numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()};
}

/// Throws: std::invalid_argument unless the bytes are whole numbers of 8 bytes.
inline std::vector<double> to_numbers(std::string_view bytes) {
  return words<std::uint64_t, double>(bytes);
}

/// Throws: std::invalid_argument for a number that is negative or too large.
template <std::integral Count>
Count count_of(std::int64_t value) {
  if (std::in_range<Count>(value) && value >= 0) return static_cast<Count>(value);
  throw invalid_argument(value, " is no count");
}

/// Takes from the front what `append` put there. Throws: std::invalid_argument where the bytes end too early.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  std::string_view take(std::uint64_t length) {
    if (length > rest_.size()) throw invalid_argument("the bytes end too early");
    const std::string_view taken = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return taken;
  }
  std::uint64_t word() { return word_at<std::uint64_t>(take(8).data()); }
  std::int64_t integer() { return static_cast<std::int64_t>(word()); }
  double number() { return std::bit_cast<double>(word()); }
  bool at_end() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

}  // namespace sila::bytes
