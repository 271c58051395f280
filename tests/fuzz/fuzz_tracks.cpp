// The text readers of tracks. The first byte says how: the format recognised or forced, which options, or the meta
// files of inD.

#include "sila/io/files.hpp"
#include "support/scratch.hpp"
#include "track_text.hpp"

namespace sila::fuzz {
namespace {

/// Where an inD recording's meta files are; made once, removed at the end.
struct Recording {
  tests::ScratchFolder folder;
  Recording() {
    write_file(folder / "00_tracksMeta.csv", "trackId,class\n1,pedestrian\n2,car\n");
    write_file(folder / "00_recordingMeta.csv", "recordingId,frameRate\n0,25\n");
  }
  std::string path() const { return (folder / "00_tracks.csv").string(); }
};

void read_meta_bytes(const std::string& bytes) {
  const std::string path = "made-up_tracksMeta.csv";
  accepts(path, lines_in(bytes), [&] { two_columns(path, text_of_bytes(path, bytes), "trackid", "class"); });
}

ReadOptions options_of(unsigned how) {
  ReadOptions options;
  const unsigned formats = static_cast<unsigned>(track_formats().size());
  if (how % (formats + 1) < formats) options.format = track_formats()[how % (formats + 1)].format;
  const unsigned rest = how / (formats + 1);
  if (rest & 1U) options.frames_per_second = 25.0;
  if (rest & 2U) options.sample_interval_s = 0.4;
  if (rest & 4U) options.metres_per_unit = 0.01;
  if (rest == 8U) {
    options.camera = Camera{};
    options.camera->ground_from_image(2, 1) = -0.001;  // its horizon is at v = 1000
    options.frames_per_second = 25.0;
  }
  return options;
}

}  // namespace
}  // namespace sila::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sila::fuzz;
  static const Recording recording;
  if (size == 0) return 0;
  const std::string bytes = text_of(data + 1, size - 1);
  if (data[0] == 255) {
    read_meta_bytes(bytes);
  } else {
    read_track_bytes(recording.path(), bytes, options_of(data[0]));
  }
  return 0;
}
