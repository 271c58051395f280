#include "sila/model/place.hpp"

#include <algorithm>

namespace sila {
namespace {

constexpr double kSameOrigin_m = 1.0;
constexpr double kSameAxisCosine = 0.996;

}  // namespace

bool same_place(const CurbFrame& a, const CurbFrame& b) {
  return (a.origin_m - b.origin_m).norm() <= kSameOrigin_m && a.axis_1.dot(b.axis_1) >= kSameAxisCosine &&
         a.axis_2.dot(b.axis_2) >= kSameAxisCosine;
}

bool is_known(const std::vector<CurbFrame>& places, const CurbFrame& frame) {
  return std::any_of(places.begin(), places.end(), [&](const CurbFrame& place) { return same_place(place, frame); });
}

std::vector<CurbFrame> with_places(std::vector<CurbFrame> places, const std::vector<CurbFrame>& more) {
  for (const CurbFrame& place : more) {
    if (!is_known(places, place)) places.push_back(place);
  }
  return places;
}

}  // namespace sila
