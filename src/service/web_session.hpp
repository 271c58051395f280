#pragma once

#include <boost/asio/ip/tcp.hpp>

#include "connection.hpp"

namespace sila::detail {

/// Answers HTTP on a socket: the live page at /, /metrics, /healthz; WebSockets at /stream (lines both ways) and /live
/// (messages for the live page).
void serve_web(ConnectionRegistry& registry, boost::asio::ip::tcp::socket socket);

}  // namespace sila::detail
