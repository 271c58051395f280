// The lines of the live service: parsed, and ingested by the stream core.

#include <set>

#include "promises.hpp"
#include "service/lines.hpp"
#include "sila/service/stream.hpp"

namespace sila::fuzz {
namespace {

ServiceSettings settings() {
  ServiceSettings made;
  const CurbFrame frame = make_curb_frame({0, 0}, {1, 0}, {0, 1}, 2.5);
  made.frame_for = [frame](const Trajectory&) { return frame; };
  made.service.max_ids = 3;
  made.service.clock_patience = 2;
  made.service.max_track_samples = 8;
  return made;
}

void require_sound(const Detection& row) {
  require(!row.track.empty() && row.track.size() <= 64, "an id has 1 to 64 bytes", row.track);
}

/// The reported line depends on the reason alone, so each reason is checked once.
void require_reported(Rejection rejection) {
  static std::set<Rejection> reported;
  if (reported.insert(rejection).second) require(!rejection_line(rejection, 1).empty(), "a rejection can be reported");
}

/// Every prediction request has a valid observed path.
void validate_requests(StreamCore& core, const ServiceSettings& made) {
  for (const PredictionRequest& request : take_due_requests(core, 100, made)) validate(request.observed);
}

}  // namespace
}  // namespace sila::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sila;
  using namespace sila::fuzz;
  static const ServiceSettings made = settings();
  const std::string text = text_of(data, size);
  StreamCore core;
  std::uint64_t accepted = 0;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    parse_token(line);
    const ParsedLine parsed = parse_line(line, {.frigate_camera = std::string()}, true);
    for (const Detection& row : parsed.detections) {
      require_sound(row);
      const IngestResult result = ingest(core, 1, row, 0.0, made);
      accepted += result.rejection ? 0 : 1;
      require(core.streams[1].pedestrians.size() <= 3, "no more than service.max_ids tracks are open");
    }
    for (const Rejection rejection : parsed.rejections) {
      require(rejection == Rejection::not_json || rejection == Rejection::not_a_detection ||
                  rejection == Rejection::other_camera,
              "the reason fits the line");
      require_reported(rejection);
    }
  }
  validate_requests(core, made);
  end_stream(core, 1, made);
  require(core.counters.detections == accepted, "every accepted line is counted");
  require(core.counters.detections == core.counters.not_due + core.counters.predictions + core.counters.superseded,
          "every detection is counted once");
  for (const FramedTrajectory& track : core.finished) validate(track.track);
  return 0;
}
