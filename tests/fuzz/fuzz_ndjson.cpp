// The readers of JSON lines: TrajNet++, and the input of the service. The length says which of the two.

#include "track_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sila::ReadOptions options;
  options.format = size % 2 == 0 ? sila::TrackFormat::trajnetpp : sila::TrackFormat::ndjson;
  sila::fuzz::read_track_bytes("made-up.ndjson", sila::fuzz::text_of(data, size), options);
  return 0;
}
