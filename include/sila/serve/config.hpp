#pragma once

#include <concepts>

#include "sila/core/fields.hpp"

namespace sila {

/// What a service takes from its connections and gives to them.
struct ServeConfig {
  int max_line_bytes = 4096;
  double max_rate_hz = 20000.0;
  int max_connections = 64;
  int max_waiting_lines = 20000;
  double max_outgoing_mb = 16.0;
  double page_every_s = 0.2;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, ServeConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("max_line_bytes", config.max_line_bytes, Range{64, 1 << 20}, "bytes",
               "of a line; longer ones are refused");
  visit.number("max_rate_hz", config.max_rate_hz, Range{0.0, 1e7, true}, "lines/s",
               "of a connection, averaged over a second; more are refused");
  visit.number("max_connections", config.max_connections, Range{1, 10000}, "connections", "at a time");
  visit.number("max_waiting_lines", config.max_waiting_lines, Range{1, 10000000}, "lines",
               "that were read and not yet looked at; beyond it, of whom more than a fair share waits are refused");
  visit.number("max_outgoing_mb", config.max_outgoing_mb, Range{0.01, 1e4}, "MB",
               "that wait for a connection to read them; beyond it the oldest predictions are dropped");
  visit.number("page_every_s", config.page_every_s, Range{0.02, 60.0}, "s", "between pictures of the live page");
}

}  // namespace sila
