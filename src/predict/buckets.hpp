#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "sila/core/curb_frame.hpp"

namespace sila {

/// Square buckets that the plane is cut into, to find what is near a point; `size` is their side.
/// Points over 2^31 buckets away share buckets with others.
inline std::int64_t bucket_key(std::int64_t column, std::int64_t row) {
  return (column << 32) ^ (row & 0xffffffff);
}

inline std::int64_t bucket_column(double coordinate, double size) {
  constexpr double farthest = 9e18;  // what an integer can hold
  return static_cast<std::int64_t>(std::clamp(std::floor(coordinate / size), -farthest, farthest));
}

/// Where the bucket with this key is, if it shares the key with no other.
inline Vector2 bucket_middle(std::int64_t key, double size) {
  const auto column = key >> 32, row = static_cast<std::int64_t>(static_cast<std::int32_t>(key));
  return size * (Vector2(static_cast<double>(column), static_cast<double>(row)) + Vector2::Constant(0.5));
}

inline std::int64_t bucket_of(const Vector2& position, double size) {
  return bucket_key(bucket_column(position.x(), size), bucket_column(position.y(), size));
}

/// What reaches over more buckets than this is better looked at always than entered in each of them.
inline constexpr double kMostBuckets = 1e4;

/// About how many buckets touch the box from `low` to `high`.
inline double count_buckets(const Vector2& low, const Vector2& high, double size) {
  return ((high.x() - low.x()) / size + 1.0) * ((high.y() - low.y()) / size + 1.0);
}

/// Calls `visit(key, lower corner)` for each bucket that touches the box from `low` to `high`, column by column.
template <class Visit>
void for_each_bucket(const Vector2& low, const Vector2& high, double size, Visit&& visit) {
  const std::int64_t last_column = bucket_column(high.x(), size), last_row = bucket_column(high.y(), size);
  for (std::int64_t column = bucket_column(low.x(), size); column <= last_column; ++column) {
    for (std::int64_t row = bucket_column(low.y(), size); row <= last_row; ++row)
      visit(bucket_key(column, row), Vector2(static_cast<double>(column) * size, static_cast<double>(row) * size));
  }
}

}  // namespace sila
