#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

namespace sila {

/// Memory for the steps of a prediction: arrays are handed out one after another and all taken back at once, so that
/// the next prediction allocates nothing. One for each thread; what it handed out lives until `reset`, at most as long
/// as it does.
class Scratch {
 public:
  /// Numbers in it are not set; members of structs have their defaults.
  template <class T>
  std::span<T> array(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T> && alignof(T) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);
    T* first = static_cast<T*>(take(count * sizeof(T)));
    std::uninitialized_default_construct_n(first, count);
    return {first, count};
  }

  /// Takes every array back and keeps the memory, in one piece from now on.
  void reset();

 private:
  void* take(std::size_t bytes);

  std::vector<std::vector<std::byte>> blocks_;  ///< the last one is in use
  std::size_t used_ = 0;                        ///< of the last block
};

}  // namespace sila
