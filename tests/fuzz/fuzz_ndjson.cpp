// The reader of TrajNet++ ndjson.

#include "track_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  sila::ReadOptions options;
  options.format = sila::TrackFormat::trajnetpp;
  sila::fuzz::read_track_bytes("made-up.ndjson", sila::fuzz::text_of(data, size), options);
  return 0;
}
