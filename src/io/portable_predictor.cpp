#include "portable_predictor.hpp"

#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/bytes.hpp"
#include "model_parts.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

/// The values of fields in their order: numbers as they are, flags as 0 or 1, choices by their index.
class FieldValues {
 public:
  template <class Number>
  void number(const char*, const Number& value, const Range&, const char*, const char*) {
    values.push_back(static_cast<double>(value));
  }
  void flag(const char*, const bool& value, const char*) { values.push_back(value ? 1.0 : 0.0); }
  template <class Enum>
  void choice(const char*, const Enum& value, std::span<const char* const>, const char*) {
    values.push_back(static_cast<double>(value));
  }
  template <class Group>
  void group(const char*, const Group& nested) {
    fields(nested, *this);
  }

  std::vector<double> values;
};

/// Sets fields to what FieldValues gave.
class FieldSetter {
 public:
  explicit FieldSetter(std::span<const double> values) : rest_(values) {}

  template <class Number>
  void number(const char* name, Number& value, const Range& range, const char*, const char*) {
    const double given = next();
    require_in_range("predictor", name, given, range);
    value = static_cast<Number>(given);
  }
  void flag(const char*, bool& value, const char*) { value = next() != 0.0; }
  template <class Enum>
  void choice(const char* name, Enum& value, std::span<const char* const> names, const char*) {
    const double given = next();
    require_in_range("predictor", name, given, Range{0.0, static_cast<double>(names.size()) - 1.0});
    value = static_cast<Enum>(given);
  }
  template <class Group>
  void group(const char*, Group& nested) {
    fields(nested, *this);
  }
  bool at_end() const { return rest_.empty(); }

 private:
  double next() {
    if (rest_.empty()) throw std::invalid_argument("predictor: its settings end too early");
    const double value = rest_.front();
    rest_ = rest_.subspan(1);
    return value;
  }

  std::span<const double> rest_;
};

}  // namespace

std::string predictor_bytes(const PortablePredictor& predictor) {
  FieldValues settings;
  settings.group("sampling", predictor.sampling);
  settings.group("predict", predictor.predict);
  Model model = predictor.model;
  model.episode_ids.clear();
  const ModelParts parts = parts_of(model, bytes::of_numbers(settings.values));
  std::string bytes;
  bytes::append_text(bytes, bytes::of_numbers(pack(predictor.frame)));
  bytes::append_text(bytes, parts.head);
  for (const std::string& part : parts.parts) bytes::append_text(bytes, part);
  return bytes;
}

PortablePredictor predictor_of_bytes(std::string_view bytes) {
  bytes::Reader reader(bytes);
  const auto text = [&] { return reader.take(reader.word()); };
  PortablePredictor predictor;
  predictor.frame = unpack<CurbFrame>(bytes::to_numbers(text()));
  ModelParts parts;
  parts.head = text();
  while (!reader.at_end()) parts.parts.emplace_back(text());
  ModelContent content = content_of(parts);
  check(content.model);
  predictor.model = std::move(content.model);
  const std::vector<double> settings = bytes::to_numbers(content.configuration);
  FieldSetter setter(settings);
  setter.group("sampling", predictor.sampling);
  setter.group("predict", predictor.predict);
  if (!setter.at_end()) throw std::invalid_argument("predictor: it has settings that are not known");
  return predictor;
}

}  // namespace sila
