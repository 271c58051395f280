#pragma once

#include <optional>
#include <unordered_map>

#include "sila/gp/sparse_gp.hpp"

namespace sila {

/// Finds GPs that a later model has unchanged from an earlier one. The GPs are not copied: they must outlive this
/// object.
class EarlierGps {
 public:
  void add(const SparseGp& gp, int index) { by_hash_.emplace(hash_of(gp), Entry{&gp, index}); }

  /// The index of an equal GP.
  std::optional<int> find(const SparseGp& gp) const {
    const auto [first, last] = by_hash_.equal_range(hash_of(gp));
    for (auto entry = first; entry != last; ++entry) {
      if (*entry->second.gp == gp) return entry->second.index;
    }
    return std::nullopt;
  }

 private:
  struct Entry {
    const SparseGp* gp;
    int index;
  };

  /// GPs that differ hardly ever have the same.
  static double hash_of(const SparseGp& gp) { return gp.points + gp.mean_response.sum(); }

  std::unordered_multimap<double, Entry> by_hash_;
};

}  // namespace sila
