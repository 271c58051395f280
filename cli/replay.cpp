#include "sila/service/replay.hpp"

#include <csignal>
#include <iomanip>
#include <iostream>

#include "options.hpp"

namespace sila::cli {
namespace {

struct ReplayVerb {
  CommonOptions common;
  TrackOptions tracks;
  std::string to, token_file;
  double rate = 1.0, apart_s = 0.0, linger_s = 2.0;
};

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

void tell(const ReplayReport& report) {
  std::cerr << counted(report.sent, "detection") << " sent, " << counted(report.predictions, "prediction") << ", "
            << report.dropped << " reported as dropped, " << counted(report.rejected, "line") << " rejected\n";
  if (report.latencies_s.empty()) return;
  std::cerr << std::fixed << std::setprecision(1) << "detection to prediction: median "
            << 1e3 * quantile(report.latencies_s, 0.5) << " ms, 90 % " << 1e3 * quantile(report.latencies_s, 0.9)
            << " ms, 99 % " << 1e3 * quantile(report.latencies_s, 0.99) << " ms, longest "
            << 1e3 * report.latencies_s.back() << " ms, of " << report.latencies_s.size() << "\n";
}

void replay_tracks(const ReplayVerb& options) {
  const Config config = configured(options.common);
  CleanTracks tracks = read_clean(options.tracks, config).tracks;
  if (const auto camera = pixel_camera(config)) {  // as a tracker would send them
    for (Trajectory& track : tracks.trajectories) {
      for (Vector2& position : track.positions_m) position = to_image(*camera, position).value();
    }
  }
  const std::vector<TimedLine> lines = timed_lines(tracks, options.apart_s);
  std::cerr << counted(lines.size(), "detection") << " over " << lines.back().at_s / options.rate << " s\n";
  std::signal(SIGPIPE, SIG_IGN);
  if (options.to.empty()) {
    replay(lines, options.rate, [](const TimedLine& line) {
      return bool(std::cout << line.text << "\n" << std::flush);
    });
    return;
  }
  const std::string token = options.token_file.empty() ? std::string() : first_line("--token-file", options.token_file);
  tell(of_options([&] {
    return replay_to(options.to, token, lines, options.rate, options.linger_s,
                     [](const std::string& line) { std::cout << line << "\n"; });
  }));
}

}  // namespace

void add_replay(CLI::App& app) {
  const auto [verb, options] =
      add_verb(app,
               {"replay", "Send recorded tracks as a live tracker would.",
                "sila replay tracks.csv --rate 10 --to tcp:127.0.0.1:8766 > predictions.ndjson"},
               Shared::configuration, replay_tracks);
  add_tracks(*verb, options->tracks);
  verb->add_option("--rate", options->rate, "speed: 10 plays the recording ten times as fast [1]")
      ->check(positive_number);
  CLI::Option* to = verb->add_option(
      "--to", options->to, "tcp:ADDRESS:PORT or unix:PATH [standard output]; predictions go to standard output");
  to->type_name("ADDRESS");
  verb->add_option("--apart", options->apart_s,
                   "seconds between the starts of consecutive tracks, for tracks without a common clock")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--linger", options->linger_s, "longest wait for the last predictions, in seconds [2]")
      ->needs(to)
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--token-file", options->token_file, "file whose first line is the token of the service")
      ->needs(to)
      ->type_name("FILE");
}

}  // namespace sila::cli
