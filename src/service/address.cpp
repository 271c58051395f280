#include "address.hpp"

#include <charconv>
#include <stdexcept>

namespace sila::detail {

boost::asio::ip::tcp::endpoint parse_endpoint(const std::string& option, const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::string host = text.substr(0, colon);
  if (host.empty() || host == "localhost") host = "127.0.0.1";
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + (colon + 1), end, port);  // npos + 1 is 0
  boost::system::error_code unknown;
  const boost::asio::ip::address address = boost::asio::ip::make_address(host, unknown);
  if (colon == std::string::npos || error != std::errc{} || rest != end || unknown)
    throw std::invalid_argument(option + " = " + text + " is not ADDRESS:PORT, as in 127.0.0.1:8765 or [::1]:8765");
  return {address, port};
}

}  // namespace sila::detail
