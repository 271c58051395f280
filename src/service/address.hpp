#pragma once

#include <cstdint>
#include <string>

namespace sila::detail {

struct Address {
  std::string host;
  std::uint16_t port = 0;
};

/// "127.0.0.1:8765", "[::1]:8765", ":8765" (loopback). Throws: std::invalid_argument, naming `option`.
Address parse_address(const std::string& option, const std::string& text);

/// Whether this machine alone can reach the address.
bool is_loopback(const Address& address);

}  // namespace sila::detail
