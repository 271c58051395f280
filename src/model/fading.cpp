#include "sila/model/fading.hpp"

namespace sila {

Lessons faded(Lessons lessons, double share) {
  for (auto* table : {&lessons.with_map, &lessons.without_map}) {
    for (RegressionMoments& cell : *table) cell.weight *= share, cell.features *= share, cell.products *= share;
  }
  for (auto* table : {&lessons.residuals_with_map, &lessons.residuals_without_map, &lessons.residuals_place_free}) {
    for (ResidualMoments& cell : *table) cell.weight *= share, cell.along_m2 *= share, cell.across_m2 *= share;
  }
  for (std::vector<double>& bins : lessons.surprises) {
    for (double& count : bins) count *= share;
  }
  for (double& count : lessons.novelties) count *= share;
  return lessons;
}

}  // namespace sila
