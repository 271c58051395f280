#include "portable_predictor.hpp"

#include "core/bytes.hpp"
#include "model/model_parts.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

/// Visits the fields of a configuration as numbers: flags as 0 or 1, choices by their index.
template <class Visit>
class NumberVisitor {
 public:
  explicit NumberVisitor(Visit visit) : visit_(std::move(visit)) {}

  void number(const char* name, auto& value, const Range& range, const char*, const char*) {
    visit_(name, value, range);
  }
  void flag(const char* name, auto& value, const char*) { visit_(name, value, Range{0.0, 1.0}); }
  void choice(const char* name, auto& value, std::span<const char* const> names, const char*) {
    visit_(name, value, Range{0.0, static_cast<double>(names.size()) - 1.0});
  }
  void group(const char*, auto& nested) { fields(nested, *this); }

 private:
  Visit visit_;
};

std::vector<double> numbers_of(const SamplingConfig& sampling, const RefineConfig& predict) {
  std::vector<double> numbers;
  NumberVisitor visitor(
      [&](const char*, const auto& value, const Range&) { numbers.push_back(static_cast<double>(value)); });
  fields(sampling, visitor);
  fields(predict, visitor);
  return numbers;
}

/// Sets the settings to what `numbers_of` gave.
void set_numbers(SamplingConfig& sampling, RefineConfig& predict, std::span<const double> numbers) {
  NumberVisitor visitor([&]<class Value>(const char* name, Value& value, const Range& range) {
    if (numbers.empty()) throw std::invalid_argument("predictor: its settings end too early");
    require_in_range("predictor", name, numbers.front(), range);
    value = static_cast<Value>(numbers.front());
    numbers = numbers.subspan(1);
  });
  fields(sampling, visitor);
  fields(predict, visitor);
  if (!numbers.empty()) throw std::invalid_argument("predictor: it has settings that are not known");
}

}  // namespace

std::string predictor_bytes(const PortablePredictor& predictor) {
  Model model = predictor.model;
  model.episode_ids.clear();
  const ModelParts parts = parts_of(model, bytes::of_numbers(numbers_of(predictor.sampling, predictor.predict)));
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
  set_numbers(predictor.sampling, predictor.predict, bytes::to_numbers(content.configuration));
  return predictor;
}

}  // namespace sila
