#pragma once

#include <string>
#include <vector>

#include <gdfmap/db/database.hpp>
#include <gdfmap/store/cube_store.hpp>

namespace gdfmap {

/// What CubeStore::verify() does. @param database  the store's own connection
[[nodiscard]] std::vector<std::string> verify_store(CubeStore& store, db::Database& database,
                                                    bool checksums);

}  // namespace gdfmap
