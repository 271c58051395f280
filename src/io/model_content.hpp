#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sila/model/model.hpp"

/// What the tables of a model file hold of a model, as plain numbers and bytes: what is written, compared, summed up
/// and undone without being understood.
namespace sila::rows {

struct PrimitiveRow {
  double weight = 0.0;
  std::int64_t support = 0;
  std::string cells;       ///< 32-bit integers: x and y of each
  std::string velocities;  ///< doubles: x and y of each
  bool operator==(const PrimitiveRow&) const = default;
};

struct TransitionRow {
  std::int64_t from = 0;
  std::int64_t to = 0;
  double count = 0.0;
  std::string field;     ///< doubles: the sparse GP and its extent
  std::string residual;  ///< doubles: the sparse GP
  std::string sites;     ///< doubles: site, count and last episode of each
  std::int64_t support = 0;
  bool operator==(const TransitionRow&) const = default;
};

struct SiteRow {
  std::string frame;  ///< doubles
  std::int64_t episodes = 0;
  std::int64_t tracks = 0;
  std::string error_statistics;  ///< doubles
  std::string global_residual;   ///< doubles: the sparse GP
  bool operator==(const SiteRow&) const = default;
};

struct Content {
  std::int64_t episodes = 0;
  std::int64_t tracks = 0;
  std::string configuration;
  std::int64_t sharing = 0;               ///< SiteSharing
  std::string settings, global_residual;  ///< doubles
  std::vector<SiteRow> sites;
  std::vector<PrimitiveRow> primitives;
  std::vector<TransitionRow> transitions;
  std::vector<std::string> learnt;  ///< 16 bytes each, in the order of the ids
  bool operator==(const Content&) const = default;
};

Content content_of(const Model& model, const std::string& configuration);

/// Throws: std::invalid_argument for bytes that make no model.
Model model_of(const Content& content);

/// Puts ids read in any order in theirs. Throws: std::invalid_argument unless all have 16 bytes.
void sort_learnt(std::vector<std::string>& learnt);

/// CRC-32 of bytes, going on from that of the bytes before.
std::int64_t crc(std::string_view bytes, std::int64_t before = 0);

/// Over everything a flipped bit of which would go unnoticed: SQLite has no checksums of its own.
std::int64_t checksum(const Content& content);

}  // namespace sila::rows
