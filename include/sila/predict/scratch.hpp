#pragma once

#include <cstddef>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <type_traits>

namespace sila {

/// Memory for the intermediate arrays of a prediction, released all at once. One for each thread; an array lives until
/// `reset`. Once the buffer is large enough, a prediction allocates nothing.
class Scratch {
 public:
  /// Numbers in it are not set; members of structs have their defaults.
  template <class T>
  std::span<T> array(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T>);
    used_ += count * sizeof(T) + alignof(T);
    T* first = std::pmr::polymorphic_allocator<T>(&*memory_).allocate(count);
    std::uninitialized_default_construct_n(first, count);
    return {first, count};
  }

  /// Releases every array; the buffer grows to what was used.
  void reset() {
    memory_.reset();
    if (used_ > size_) {
      size_ = 2 * used_;
      buffer_ = std::make_unique_for_overwrite<std::byte[]>(size_);
    }
    used_ = 0;
    memory_.emplace(buffer_.get(), size_);
  }

 private:
  std::size_t size_ = std::size_t{1} << 16;
  std::size_t used_ = 0;  ///< at most, with alignment
  std::unique_ptr<std::byte[]> buffer_ = std::make_unique_for_overwrite<std::byte[]>(size_);
  std::optional<std::pmr::monotonic_buffer_resource> memory_{std::in_place, buffer_.get(), size_};
};

}  // namespace sila
