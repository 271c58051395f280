#pragma once

#include <string_view>

#include "sila/core/sampling.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// All that predicts at a site, for a program that has neither SQLite nor JSON (wasm/predictor.cpp).
struct PortablePredictor {
  Model model;
  CurbFrame frame;  ///< of the site
  SamplingConfig sampling;
  RefineConfig predict;
};

/// The bytes of a predictor: `predictor_of_bytes(predictor_bytes(p))` gives the predictions of `p`, bit for bit. The
/// ids of the batches that the model learnt are left out.
std::string predictor_bytes(const PortablePredictor& predictor);

/// Throws: std::invalid_argument for bytes that make no predictor.
PortablePredictor predictor_of_bytes(std::string_view bytes);

}  // namespace sila
