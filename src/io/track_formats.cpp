#include <algorithm>
#include <stdexcept>

#include "sila/io/track_files.hpp"

namespace sila {
namespace {

constexpr std::array<TrackFormatText, 19> kFormats{{
    {TrackFormat::csv, "csv", "a header line with track_id,t,x,y"},
    {TrackFormat::obsmat, "obsmat", "8 columns: frame id x z y vx vz vy"},
    {TrackFormat::frame_id_x_y, "frame-id-x-y", "4 columns: frame id x y"},
    {TrackFormat::trajnetpp, "trajnetpp", "lines like {\"track\": {\"f\": 0, \"p\": 1, \"x\": 0.5, \"y\": 2.0}}"},
    {TrackFormat::stanford_drone, "sdd", "10 columns: id xmin ymin xmax ymax frame lost occluded generated \"label\""},
    {TrackFormat::ind, "ind", "a header line with trackId,frame,xCenter,yCenter"},
    {TrackFormat::sind, "sind", "a header line with track_id,timestamp_ms,agent_type,x,y"},
    {TrackFormat::dut, "dut", "a header line with id,frame,label,x_est,y_est"},
    {TrackFormat::vru, "vru", "a header line with timestamp,x,y"},
    {TrackFormat::juelich, "juelich", "columns: id frame x y z"},
    {TrackFormat::ndjson, "ndjson", "lines like {\"t\": 0.1, \"id\": \"a\", \"x\": 0.5, \"y\": 2.0}"},
    {TrackFormat::mot, "mot", "7, 9 or 10 columns with commas: frame,id,left,top,width,height,confidence"},
    {TrackFormat::kitti, "kitti", "17 or 18 columns: frame id type truncated occluded alpha left top right bottom ..."},
    {TrackFormat::sumo_fcd, "sumo-fcd", "XML like <fcd-export><timestep time=\"0\"><person id=\"a\" x=\"1\" y=\"2\"/>"},
    {TrackFormat::boxes, "boxes", "a header line with x_min,y_min,x_max,y_max,tracker_id and a frame or time"},
    {TrackFormat::frigate, "frigate",
     "lines like {\"after\": {\"id\": \"a\", \"frame_time\": 1.5, \"box\": [1, 2, 3, 4]}}"},
    {TrackFormat::axis, "axis", "lines like {\"frame\": {\"timestamp\": ..., \"observations\": [...]}}"},
    {TrackFormat::ottrk, "ottrk", "JSON like {\"metadata\": ..., \"data\": {\"detections\": [...]}}"},
    {TrackFormat::opendatacam, "opendatacam", "a JSON array of {\"timestamp\": ..., \"objects\": [...]}"},
}};

}  // namespace

std::span<const TrackFormatText> track_formats() {
  return kFormats;
}

std::string_view name_of(TrackFormat format) {
  return kFormats[static_cast<std::size_t>(format)].name;
}

std::optional<TrackFormat> track_format(std::string_view name) {
  const auto found = std::ranges::find(kFormats, name, &TrackFormatText::name);
  return found == kFormats.end() ? std::nullopt : std::optional(found->format);
}

TrackFormat required_format(std::string_view name, const std::string& what) {
  if (const auto format = track_format(name)) return *format;
  std::string known;
  for (const TrackFormatText& format : kFormats) known += (known.empty() ? "" : ", ") + std::string(format.name);
  throw std::invalid_argument(what + " is not one of " + known);
}

}  // namespace sila
