#include "web_request.hpp"

#include "lines.hpp"

namespace sila::detail {
namespace {

constexpr std::string_view kBearer = "Bearer ";

/// The token of a request; tokens have no characters that a query must escape (docs/service.md).
std::string token_of(const WebRequest& request) {
  if (request.authorization.starts_with(kBearer)) return request.authorization.substr(kBearer.size());
  const std::size_t query = request.target.find('?');
  if (query == std::string::npos) return {};
  std::string_view rest = std::string_view(request.target).substr(query + 1);
  while (!rest.empty()) {
    const std::size_t end = rest.find('&');
    const std::string_view pair = rest.substr(0, end);
    if (pair.starts_with("token=")) return std::string(pair.substr(6));
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  }
  return {};
}

std::string_view without_port(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  return colon == std::string_view::npos || host.ends_with(']') ? host : host.substr(0, colon);
}

}  // namespace

std::string path_of(const WebRequest& request) {
  return request.target.substr(0, request.target.find('?'));
}

std::optional<std::string> rejection_of(const WebRequest& request, const std::string& token) {
  if (!request.origin.empty()) {
    const std::size_t scheme = request.origin.find("://");
    if (scheme == std::string::npos || request.origin.substr(scheme + 3) != request.host)
      return "pages of other sites may not use this service";
  }
  if (!token.empty()) {
    if (same_token(token_of(request), token)) return std::nullopt;
    return "the token of the service is missing or wrong: send it as `Authorization: Bearer TOKEN` or as ?token=TOKEN";
  }
  const std::string_view host = without_port(request.host);
  if (host.empty() || host == "localhost" || host == "[::1]") return std::nullopt;
  // Digits and dots: an address, not a name that begins like one.
  if (host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string_view::npos) return std::nullopt;
  return "without a token this service answers only to localhost";
}

}  // namespace sila::detail
