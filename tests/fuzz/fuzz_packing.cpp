// The blobs of a model file: numbers that should be parts of a model. The first byte says of which part.

#include <stdexcept>

#include "io/made_up_model.hpp"
#include "numbers.hpp"
#include "promises.hpp"
#include "sila/model/packing.hpp"

namespace sila::fuzz {
namespace {

constexpr unsigned kParts = 6;

/// What is unpacked packs to the same numbers, bit for bit.
template <class Part>
void unpack_and_pack(std::span<const double> numbers) {
  std::vector<double> again;
  try {
    again = pack(unpack<Part>(numbers));
  } catch (const std::invalid_argument& error) {
    require(std::string_view(error.what()).starts_with("unpack: "), "the reason is said", error.what());
    return;
  }
  require(again.size() == numbers.size() &&
              (again.empty() || std::memcmp(again.data(), numbers.data(), 8 * again.size()) == 0),
          "what is unpacked packs to the same numbers");
}

void unpack_part(unsigned part, std::span<const double> numbers) {
  if (part == 0) unpack_and_pack<ErrorStatistics>(numbers);
  if (part == 1) unpack_and_pack<FlowField>(numbers);
  if (part == 2) unpack_and_pack<SparseGp>(numbers);
  if (part == 3) unpack_and_pack<CurbFrame>(numbers);
  if (part == 4) unpack_and_pack<AllSettings>(numbers);
  if (part == 5) unpack_and_pack<std::vector<SiteCount>>(numbers);
}

std::vector<double> part_of(unsigned part, const Model& model) {
  if (part == 0) return pack(of_one_step(model.refinement.error_statistics.front()));
  if (part == 1) return pack(model.transitions.front().field);
  if (part == 2) return pack(model.refinement.residuals.front());
  if (part == 3) return pack(model.sites.front().frame);
  if (part == 5) return pack(model.transitions.front().sites);
  return pack(AllSettings{model.settings, model.refinement.residual_settings});
}

}  // namespace
}  // namespace sila::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::vector<double> numbers = sila::fuzz::numbers_of(data + 1, size - 1);
  sila::fuzz::unpack_part(data[0] % sila::fuzz::kParts, numbers);
  return 0;
}

/// Most inputs are parts of a made-up model with one number spoilt; libFuzzer makes the others.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  using namespace sila::fuzz;
  static const sila::Model model = sila::random_model(1);
  std::mt19937 random(seed);
  if (size < 9 || random() % 64 == 0) {
    data[0] = static_cast<std::uint8_t>(random() % kParts);
    return 1 + put_numbers(part_of(data[0], model), data + 1, max_size - 1);
  }
  if (random() % 4 == 0) return LLVMFuzzerMutate(data, size, max_size);
  std::vector<double> numbers = numbers_of(data + 1, size - 1);
  spoil(numbers, random);
  return 1 + put_numbers(numbers, data + 1, max_size - 1);
}
