#include <iterator>

#include <gdfmap/pipeline/verify.hpp>

namespace gdfmap {

VerifyReport verify(Map& map, bool quick) {
  VerifyReport report;
  report.faults = map.cubes().verify(!quick);
  if (map.has_points()) {
    std::vector<std::string> faults = map.points().verify(!quick);
    report.faults.insert(report.faults.end(), std::make_move_iterator(faults.begin()),
                         std::make_move_iterator(faults.end()));
  }
  report.content_digest = map.cubes().content_digest();
  return report;
}

}  // namespace gdfmap
