// Configuration files and --set. The first byte says which of the two.

#include <array>
#include <stdexcept>

#include "json_file.hpp"
#include "promises.hpp"
#include "sila/config.hpp"
#include "sila/io/config_json.hpp"
#include "text_file.hpp"

namespace sila::fuzz {
namespace {

void require_valid(const Config& config, std::size_t size) {
  validate_fields("config", config);  // its error would end the run
  if (size % 8 != 0) return;          // the rest takes ten times as long
  const nlohmann::ordered_json written = to_json(config);
  const Config again = apply_json(Config{}, nlohmann::json(written), "written");
  require(to_json(again) == written, "a configuration is written as it is read", written.dump());
}

void read_file(const std::string& bytes) {
  const std::string path = "made-up.json";
  Config config;
  if (accepts(path, lines_in(bytes),
              [&] { config = read_config(Config{}, json_of_text(path, text_of_bytes(path, bytes)), path); }))
    require_valid(config, bytes.size());
}

void read_assignment(const std::string& text) {
  Config config;
  try {
    config = set_field(config, text);
  } catch (const std::invalid_argument& error) {
    require(std::string_view(error.what()).starts_with("set: expected "), "what was expected is said", error.what());
    return;
  }
  require_valid(config, text.size());
}

}  // namespace
}  // namespace sila::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string text = sila::fuzz::text_of(data + 1, size - 1);
  data[0] % 4 == 0 ? sila::fuzz::read_assignment(text) : sila::fuzz::read_file(text);
  return 0;
}

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

/// Half of the inputs are made of a field that exists and a value that means trouble; libFuzzer makes the others.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  if (seed % 2 == 0) return LLVMFuzzerMutate(data, size, max_size);
  static const std::vector<sila::FieldInfo> known = sila::list_fields(sila::Config{});
  static constexpr std::array<const char*, 20> values = {"0",
                                                         "-1",
                                                         "1e308",
                                                         "-0.0",
                                                         "2147483648",
                                                         "9223372036854775808",
                                                         "18446744073709551615",
                                                         "1e-320",
                                                         "\"inf\"",
                                                         "\"-inf\"",
                                                         "\"nan\"",
                                                         "true",
                                                         "null",
                                                         "{}",
                                                         "[]",
                                                         "0.5",
                                                         "3",
                                                         "1e999",
                                                         "-9223372036854775808",
                                                         "1000"};
  const sila::FieldInfo& field = known[(seed / 2) % known.size()];
  const std::string value = values[(seed / 1024) % values.size()];
  const bool assigns = (seed / 32768) % 4 == 0;
  const std::string text =
      assigns ? std::string(1, '\0') + field.path + "=" + value : "\1{\"" + field.path + "\": " + value + "}";
  const std::size_t length = std::min(text.size(), max_size);
  std::copy_n(text.begin(), length, data);
  return (seed / 131072) % 2 == 0 ? length : LLVMFuzzerMutate(data, length, max_size);
}
