#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "sila/io/model_store.hpp"
#include "sila/live/tuning.hpp"

namespace sila {

nlohmann::ordered_json to_json(const Tuning& tuning);

/// The tuning that the last episode was kept with; none if there is none, or it is none.
Tuning last_tuning(std::span<const EpisodeRecord> episodes);

}  // namespace sila
