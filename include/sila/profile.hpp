#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "sila/config.hpp"

namespace sila {

/// Names of the profiles: `default`; `paper`, the published method in its fairest reading; `paper-literal`, the same to
/// the letter. Source: docs/decisions/0100-profiles.md.
std::vector<std::string> profile_names();

/// The configuration with every field that any profile sets as the named one has it; all other fields stay.
/// Throws: std::invalid_argument for an unknown name (with the nearest known one).
Config with_profile(Config config, std::string_view name);

/// The whole configuration of a profile. Throws: as with_profile.
Config profile(std::string_view name);

/// As apply_json; beside fields the object may name a `profile`, which comes first, so that its fields may be set
/// beside it. Throws: FormatError as apply_json, and for an unknown profile.
Config read_config(Config config, const nlohmann::json& json, std::string_view source);

}  // namespace sila
