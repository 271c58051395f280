#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <string>

namespace sila::detail {

/// "127.0.0.1:8765", "[::1]:8765", ":8765" (loopback). Throws: std::invalid_argument, naming `option`.
boost::asio::ip::tcp::endpoint parse_endpoint(const std::string& option, const std::string& text);

}  // namespace sila::detail
