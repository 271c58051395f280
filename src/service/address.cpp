#include "address.hpp"

#include <boost/asio/ip/address.hpp>
#include <charconv>
#include <stdexcept>

namespace sila::detail {

Address parse_address(const std::string& option, const std::string& text) {
  const auto reject = [&]() -> Address {
    throw std::invalid_argument(option + " = " + text + " is not ADDRESS:PORT, as in 127.0.0.1:8765 or [::1]:8765");
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return reject();
  Address address{text.substr(0, colon), 0};
  if (address.host.empty() || address.host == "localhost") address.host = "127.0.0.1";
  if (address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']')
    address.host = address.host.substr(1, address.host.size() - 2);
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, address.port);
  boost::system::error_code unknown;
  boost::asio::ip::make_address(address.host, unknown);
  if (error != std::errc{} || rest != end || unknown) return reject();
  return address;
}

bool is_loopback(const Address& address) {
  return boost::asio::ip::make_address(address.host).is_loopback();
}

}  // namespace sila::detail
