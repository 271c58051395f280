#pragma once

#include "sila/model/model.hpp"

namespace sila {

/// A model for export: only transitions that at least `min_people` different tracks support, between primitives with
/// the same support. Nothing else remains except sums over all tracks (error statistics and global residual GP;
/// docs/privacy.md). May be empty. Throws: std::invalid_argument if min_people is below 1.
Model k_anonymous(Model model, int min_people);

}  // namespace sila
