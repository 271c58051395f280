#include "sila/refine/snapshot.hpp"

#include <utility>

namespace sila {

Snapshot::Snapshot(Model given, const RefineConfig& config) : model(std::move(given)), predictor(model, config) {}

Snapshot::Snapshot(Model given, const RefineConfig& config, const Snapshot& earlier)
    : model(std::move(given)), predictor(model, config, &earlier) {}

}  // namespace sila
