#pragma once

// In the place of oneTBB where there is one thread (docs/decisions/0121-predictor-in-the-page.md).
namespace tbb {

template <class Index, class Body>
void parallel_for(Index first, Index last, const Body& body) {
  for (; first < last; ++first) body(first);
}

}  // namespace tbb
