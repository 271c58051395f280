#include <boost/algorithm/string/replace.hpp>
#include <span>
#include <stdexcept>

#include "embedded_editor.hpp"
#include "embedded_page.hpp"
#include "io/json_file.hpp"
#include "sila/report/report.hpp"

namespace sila {
namespace {

/// Where the data belong in the page; viewer/build.mjs sees to it that it is there once.
constexpr std::string_view kMarker = "\"sila-report-data\"";

std::string with_data(std::span<const char* const> pieces, const nlohmann::ordered_json& data) {
  std::string page;
  for (const char* piece : pieces) page += piece;
  const std::size_t at = page.find(kMarker);
  if (at == std::string::npos) throw std::logic_error("report: the page has no place for its data");
  // Without a `<` the data cannot end the script element that they are in.
  page.replace(at, kMarker.size(), boost::replace_all_copy(one_line(data), "<", "\\u003c"));
  return page;
}

}  // namespace

std::string report_page(const nlohmann::ordered_json& data) {
  return with_data(detail::kEmbeddedPage, data);
}

std::string editor_page(const nlohmann::ordered_json& data) {
  return with_data(detail::kEmbeddedEditor, data);
}

}  // namespace sila
