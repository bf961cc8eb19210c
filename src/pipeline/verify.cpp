#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/verify.hpp>

namespace gdfmap {
namespace {

std::optional<Digest> digest_of(CubeStore& cubes) {
  try {
    return cubes.content_digest();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCorrupt) throw;
    return std::nullopt;
  }
}

}  // namespace

VerifyReport verify(Map& map, bool quick, const RunContext& context) {
  VerifyReport report;
  report.cube_faults = map.cubes().verify(!quick, context);
  if (map.has_points()) report.point_faults = map.points().verify(!quick, context);
  report.content_digest = digest_of(map.cubes());
  return report;
}

}  // namespace gdfmap
