#pragma once

#include "sila/model/lessons.hpp"

namespace sila {

/// The lessons as if each example had counted `share` as much: all of them are sums over examples.
Lessons faded(Lessons lessons, double share);

}  // namespace sila
