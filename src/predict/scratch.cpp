#include "sila/predict/scratch.hpp"

#include <algorithm>

namespace sila {
namespace {

constexpr std::size_t kAlignment = __STDCPP_DEFAULT_NEW_ALIGNMENT__;
constexpr std::size_t kFirstBlock = std::size_t{1} << 16;

}  // namespace

void Scratch::reset() {
  used_ = 0;
  if (blocks_.size() < 2) return;
  std::size_t total = 0;
  for (const auto& block : blocks_) total += block.size();
  blocks_.assign(1, std::vector<std::byte>(total));
}

void* Scratch::take(std::size_t bytes) {
  const std::size_t needed = (bytes + kAlignment - 1) / kAlignment * kAlignment;
  if (blocks_.empty() || used_ + needed > blocks_.back().size()) {
    blocks_.emplace_back(std::max(needed, blocks_.empty() ? kFirstBlock : 2 * blocks_.back().size()));
    used_ = 0;
  }
  void* const first = blocks_.back().data() + used_;
  used_ += needed;
  return first;
}

}  // namespace sila
