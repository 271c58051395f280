#pragma once

#include <optional>
#include <string>

namespace sila::detail {

/// The parts of an HTTP request that decide whether it is answered.
struct WebRequest {
  std::string target;  ///< path and query
  std::string host;    ///< headers; empty if there was none
  std::string origin;
  std::string authorization;
};

std::string path_of(const WebRequest& request);

/// Why a request is rejected, for people; none if it is accepted. With a token the request must have it, as a bearer
/// token or as `?token=`. Without one the service is for this machine alone: a page of another site in a local browser
/// must not reach it, neither by a name that resolves to this machine (Host) nor by a WebSocket (Origin).
std::optional<std::string> rejection_of(const WebRequest& request, const std::string& token);

}  // namespace sila::detail
