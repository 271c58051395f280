#include "sila/refine/predictor.hpp"

#include <utility>

#include "core/concatenate.hpp"
#include "refine/prepared_model.hpp"
#include "sila/core/sampling.hpp"

namespace sila {

Predictor::Predictor(const Model& model, const RefineConfig& config)
    : Predictor(std::make_shared<const PreparedModel>(model, config)) {}

Predictor::Predictor(std::shared_ptr<const PreparedModel> prepared) : prepared_(std::move(prepared)) {}

const PreparedModel& prepared_in(const Predictor& predictor) {
  return *predictor.prepared_;
}

const RefineConfig& Predictor::config() const {
  return prepared_->config();
}

double Predictor::interval_s() const {
  return prepared_->interval_s();
}

const Prediction& Predictor::predict(const CurbTrajectory& observed, Workspace& workspace) const {
  require_observed(observed, interval_s());
  if (prepared_->scaling() == CurbScaling::metres && observed.frame.unit_m != Vector2::Ones())
    throw invalid_argument("predict: track '", observed.id, "' has frame.unit_m = ", observed.frame.unit_m.x(),
                           ", with scaling = metres it must be 1; make the frame with that scaling");
  workspace.scratch.reset();
  const int steps = steps_in(config().horizon_s, interval_s());
  return prepared_->predict(observed, prepared_->merged_rollouts(observed, steps, workspace.scratch), workspace);
}

Prediction Predictor::predict(const CurbTrajectory& observed) const {
  Workspace workspace;
  predict(observed, workspace);
  return std::move(workspace.prediction);
}

Prediction predict(const Model& model, const CurbTrajectory& observed, const RefineConfig& config) {
  return Predictor(model, config).predict(observed);
}

Snapshot::Snapshot(Model given, const RefineConfig& config, const Snapshot* earlier)
    : model(std::move(given)),
      predictor(std::make_shared<const PreparedModel>(model, config, earlier ? &earlier->model : nullptr,
                                                      earlier ? earlier->predictor.prepared_.get() : nullptr)) {}

}  // namespace sila
