#pragma once

#include <boost/asio/ip/tcp.hpp>

#include "hub.hpp"

namespace sila::detail {

/// Answers HTTP on a socket: the live page at /, /metrics, /healthz; WebSockets at /stream (lines both ways) and /live
/// (what the page shows).
void serve_web(Hub& hub, boost::asio::ip::tcp::socket socket);

}  // namespace sila::detail
