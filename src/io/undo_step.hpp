#pragma once

#include <map>
#include <string>

#include "model_content.hpp"

/// How an episode is taken back: what it replaced, as bytes. Rows that the episode left as they were, wherever they are
/// now (fusion renumbers), are named by their place in the newer model.
namespace sila::rows {

/// What was before an episode.
struct Earlier {
  Content content;
  std::map<int, std::string> statistics;  ///< of records that the episode shortened, by number
};

/// The step from `next` back to `earlier`.
std::string make_undo(const Earlier& earlier, const Content& next);

/// Throws: std::invalid_argument for bytes that make no step, or one of another model: its result has the checksum that
/// the earlier model had, or there is none.
Earlier apply_undo(const Content& next, const std::string& step);

}  // namespace sila::rows
