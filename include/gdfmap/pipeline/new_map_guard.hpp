#pragma once

#include <gdfmap/map/map.hpp>

namespace gdfmap {

/// Removes a map that was made just now when the work on it fails before the map holds anything.
/// Declare it after the map: the map's lock is then still held, so that nobody can add to it.
class NewMapGuard {
 public:
  NewMapGuard(Map& map, bool is_new) : map_(map), armed_(is_new) {}
  ~NewMapGuard();
  NewMapGuard(const NewMapGuard&) = delete;
  NewMapGuard& operator=(const NewMapGuard&) = delete;

  void keep() { armed_ = false; }

 private:
  Map& map_;
  bool armed_;
};

}  // namespace gdfmap
