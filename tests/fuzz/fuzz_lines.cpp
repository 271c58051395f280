// The lines of the live service: parsed, and heard by the live core.

#include <cmath>
#include <set>
#include <variant>

#include "promises.hpp"
#include "sila/live/live.hpp"
#include "sila/serve/lines.hpp"

namespace sila::fuzz {
namespace {

LiveSettings settings() {
  LiveSettings made;
  const CurbFrame frame = make_curb_frame({0, 0}, {1, 0}, {0, 1}, {2.5, 2.5, 2.5}, CurbScaling::metres);
  made.frame_for = [frame](const Trajectory&) { return frame; };
  made.live.max_ids = 3;
  made.live.clock_patience = 2;
  made.live.max_track_samples = 8;
  return made;
}

void require_sound(const Detection& row) {
  require(!row.track.empty() && row.track.size() <= 64, "an id has 1 to 64 bytes", row.track);
  require(std::isfinite(row.t_s) && row.position_m.allFinite(), "time and place are finite");
}

/// What is answered depends on the reason alone, so it is looked at once for each.
void require_told(Refusal refusal) {
  static std::set<Refusal> told;
  if (told.insert(refusal).second) require(!refusal_line(refusal, 1).empty(), "a refusal can be told");
}

/// A pedestrian whom the core wants predicted has a path that a predictor takes.
void ask_all(Live& live, const LiveSettings& made) {
  for (const Question& question : ask(live, 100, made)) validate(question.observed);
}

}  // namespace
}  // namespace sila::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sila;
  using namespace sila::fuzz;
  static const LiveSettings made = settings();
  const std::string text = text_of(data, size);
  Live live;
  std::uint64_t heard = 0;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    parse_token(line);
    const auto parsed = parse_detection(line);
    if (const Detection* row = std::get_if<Detection>(&parsed)) {
      require_sound(*row);
      const Heard what = hear(live, 1, *row, 0.0, made);
      heard += what.refusal ? 0 : 1;
      require(live.streams[1].people.size() <= 3, "no more than live.max_ids tracks are open");
    } else {
      const Refusal refusal = std::get<Refusal>(parsed);
      require(refusal == Refusal::not_json || refusal == Refusal::not_a_detection, "a line is refused for what it is");
      require_told(refusal);
    }
  }
  ask_all(live, made);
  end_stream(live, 1, made);
  require(live.account.taken == heard, "every line taken is counted");
  require(live.account.taken == live.account.early + live.account.answered + live.account.superseded,
          "every detection is in the account");
  for (const FramedTrajectory& track : live.finished) validate(track.track);
  return 0;
}
