# find_package(gdfmap): the target gdfmap::gdfmap, and one for each module, e.g. gdfmap::query.
include(${CMAKE_CURRENT_LIST_DIR}/gdfmap-dependencies.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/gdfmap-targets.cmake)
