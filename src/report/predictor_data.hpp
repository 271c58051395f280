#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>

#include "sila/report/report.hpp"

namespace sila {

/// What predicts on the page: `wasm` and `model`, each deflated (RFC 1950) and in base64; of a model for which this
/// takes more than `most_bytes` only `bytes`. Null if no site is known.
nlohmann::ordered_json predictor_json(const ReportInput& input, std::size_t most_bytes);

}  // namespace sila
