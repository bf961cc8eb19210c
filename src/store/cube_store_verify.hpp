#pragma once

#include <string>
#include <vector>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/db/database.hpp>

namespace gdfmap {

/// What CubeStore::verify() does.
[[nodiscard]] std::vector<std::string> verify_store(db::Database& database, bool checksums,
                                                    const RunContext& context);

/// What CubeStore::delete_damaged() does.
[[nodiscard]] std::vector<std::string> delete_damaged_tiles(db::Database& database,
                                                            const RunContext& context);

}  // namespace gdfmap
