#include "sila/service/replay.hpp"

#include <algorithm>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <future>
#include <nlohmann/json.hpp>

#include "address.hpp"
#include "core/concatenate.hpp"
#include "engine.hpp"

namespace sila {
namespace {

using Socket = boost::asio::generic::stream_protocol::socket;

/// Between recordings that follow one another.
constexpr double kPause_s = 5.0;

/// The shift in time of each recording, so that they follow one another.
std::map<std::size_t, double> recording_shifts(const CleanTracks& tracks) {
  std::map<std::size_t, std::pair<double, double>> spans;
  for (const Trajectory& track : tracks.trajectories) {
    const auto span = spans.try_emplace(track.recording, track.times_s.front(), track.times_s.back()).first;
    span->second = {std::min(span->second.first, track.times_s.front()),
                    std::max(span->second.second, track.times_s.back())};
  }
  std::map<std::size_t, double> shifts;
  double next_s = 0.0;
  for (const auto& [recording, span] : spans) {
    shifts[recording] = next_s - span.first;
    next_s += kPause_s + span.second - span.first;
  }
  return shifts;
}

/// Matches received lines to sent ones.
class Answers {
 public:
  void sent(const TimedLine& line) {
    const std::lock_guard lock(mutex_);
    ++report_.sent;
    sent_s_[{line.track, line.t_s}] = monotonic_s();
    // A detection that is not answered for long was not due.
    if (sent_s_.size() > kMaxOpen) sent_s_.erase(sent_s_.begin());
  }

  void received(const std::string& line) {
    const double now_s = monotonic_s();
    constexpr std::string_view kTrack = "{\"track\":\"", kT0 = "\",\"t0\":";
    const std::lock_guard lock(mutex_);
    if (!line.starts_with(kTrack)) return count(line);
    ++report_.predictions;
    const std::size_t end = line.find(kT0, kTrack.size());
    if (end == std::string::npos) return;
    const double t0_s = std::strtod(line.c_str() + end + kT0.size(), nullptr);
    const auto found = sent_s_.find({line.substr(kTrack.size(), end - kTrack.size()), t0_s});
    if (found == sent_s_.end()) return;
    report_.latencies_s.push_back(now_s - found->second);
    sent_s_.erase(found);
  }

  ReplayReport report() {
    const std::lock_guard lock(mutex_);
    std::sort(report_.latencies_s.begin(), report_.latencies_s.end());
    return report_;
  }

 private:
  static constexpr std::size_t kMaxOpen = 200000;

  void count(const std::string& line) {
    const nlohmann::json line_json = nlohmann::json::parse(line, nullptr, false);
    if (!line_json.is_object()) return;
    report_.dropped += line_json.value("dropped", std::uint64_t{0});
    if (line_json.contains("rejected")) report_.rejected += line_json.value("count", std::uint64_t{0});
  }

  std::mutex mutex_;
  std::map<std::pair<std::string, double>, double> sent_s_;
  ReplayReport report_;
};

/// Writes on this thread and reads on another, until the service has answered all and closes the connection.
ReplayReport exchange(Socket& socket, const std::string& token, const std::vector<TimedLine>& lines, double rate,
                      double linger_s, const std::function<void(const std::string&)>& receive) {
  Answers answers;
  std::future<void> reader = std::async(std::launch::async, [&] {
    std::string buffer;
    boost::system::error_code error;
    while (true) {
      const std::size_t size = boost::asio::read_until(socket, boost::asio::dynamic_buffer(buffer), '\n', error);
      if (error) return;
      const std::string line = buffer.substr(0, size - 1);
      buffer.erase(0, size);
      answers.received(line);
      receive(line);
    }
  });
  boost::system::error_code error;
  if (!token.empty())
    boost::asio::write(socket, boost::asio::buffer(nlohmann::json{{"token", token}}.dump() + "\n"), error);
  const bool complete = replay(lines, rate, [&](const TimedLine& line) {
    if (error || reader.wait_for(std::chrono::seconds(0)) == std::future_status::ready) return false;
    answers.sent(line);
    boost::asio::write(socket, boost::asio::buffer(line.text + "\n"), error);
    return !error;
  });
  boost::system::error_code ignored;
  socket.shutdown(Socket::shutdown_send, ignored);
  if (complete) reader.wait_for(std::chrono::duration<double>(linger_s));
  socket.shutdown(Socket::shutdown_both, ignored);
  reader.wait();
  const ReplayReport report = answers.report();
  if (!complete)
    throw std::runtime_error(
        concatenate("replay: the service closed the connection after ", report.sent, " of ", lines.size(), " lines"));
  return report;
}

}  // namespace

std::vector<TimedLine> timed_lines(const CleanTracks& tracks, double apart_s) {
  const std::map<std::size_t, double> shifts = recording_shifts(tracks);
  std::vector<TimedLine> lines;
  for (std::size_t i = 0; i < tracks.trajectories.size(); ++i) {
    const Trajectory& track = tracks.trajectories[i];
    const double shift_s =
        apart_s > 0.0 ? apart_s * static_cast<double>(i) - track.times_s.front() : shifts.at(track.recording);
    for (std::size_t k = 0; k < track.times_s.size(); ++k) {
      const double t_s = track.times_s[k] + shift_s;
      const nlohmann::ordered_json json{
          {"t", t_s}, {"id", track.id}, {"x", track.positions_m[k].x()}, {"y", track.positions_m[k].y()}};
      lines.push_back({t_s, track.id, t_s, json.dump()});
    }
  }
  std::ranges::stable_sort(lines, {}, &TimedLine::t_s);
  const double first_s = lines.empty() ? 0.0 : lines.front().t_s;
  for (TimedLine& line : lines) line.at_s = line.t_s - first_s;
  return lines;
}

bool replay(const std::vector<TimedLine>& lines, double rate, const std::function<bool(const TimedLine&)>& send) {
  const auto start = std::chrono::steady_clock::now();
  for (const TimedLine& line : lines) {
    std::this_thread::sleep_until(start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                              std::chrono::duration<double>(line.at_s / rate)));
    if (!send(line)) return false;
  }
  return true;
}

ReplayReport replay_to(const std::string& address, const std::string& token, const std::vector<TimedLine>& lines,
                       double rate, double linger_s, const std::function<void(const std::string&)>& receive) {
  if (!(rate > 0.0)) throw invalid_argument("replay: rate = ", rate, " must be positive");
  const bool over_tcp = address.starts_with("tcp:");
  if (!over_tcp && !address.starts_with("unix:"))
    throw invalid_argument("replay: --to = ", address, " is neither tcp:ADDRESS:PORT nor unix:PATH");
  boost::asio::io_context context;
  Socket socket(context);
  try {
    if (over_tcp)
      socket.connect(detail::parse_endpoint("--to", address.substr(4)));
    else
      socket.connect(boost::asio::local::stream_protocol::endpoint(address.substr(5)));
    if (over_tcp) socket.set_option(boost::asio::ip::tcp::no_delay(true));
    return exchange(socket, token, lines, rate, linger_s, receive);
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error("replay: cannot connect to " + address + ": " + error.code().message());
  }
}

}  // namespace sila
