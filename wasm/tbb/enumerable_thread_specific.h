#pragma once

// As parallel_for.h.
namespace tbb {

template <class Value>
class enumerable_thread_specific {
 public:
  Value& local() { return value_; }

 private:
  Value value_;
};

}  // namespace tbb
