#pragma once

#include <optional>
#include <string>

namespace sila::detail {

/// What of a request decides whether it is answered.
struct WebRequest {
  std::string target;  ///< path and query
  std::string host;    ///< headers; empty if there was none
  std::string origin;
  std::string authorization;
};

std::string path_of(const WebRequest& request);

/// Why a request is refused, for people; nothing if it is not. With a token the request must show it, as a bearer token
/// or as `?token=`. Without one the service is for this machine alone: a page of another site that a browser here shows
/// must not reach it, neither by a name that points here (Host) nor by a WebSocket (Origin).
std::optional<std::string> refusal_of(const WebRequest& request, const std::string& token);

}  // namespace sila::detail
