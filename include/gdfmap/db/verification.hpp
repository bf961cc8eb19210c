#pragma once

#include <string>
#include <vector>

#include <gdfmap/db/database.hpp>

namespace gdfmap::db {

/// One look at a database for faults: everything is read from one snapshot, so that a writer beside
/// it is no fault. Collects one line for each fault, beginning with the file's path.
class Verification {
 public:
  /// @param database  outlives this; no transaction may be open
  explicit Verification(Database& database);
  ~Verification();
  Verification(const Verification&) = delete;
  Verification& operator=(const Verification&) = delete;

  void add(const std::string& fault);

  /// Runs a check that may throw: a damaged file can fail any statement, which is a fault found and
  /// no reason to stop looking. Only a stop (kInterrupted) and defects of the program get through.
  template <typename Check>
  void run(const Check& check) {
    try {
      check();
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kCorrupt && error.code() != ErrorCode::kIo) throw;
      add(error.what());
    }
  }

  /// SQLite's own check of the file; the quick one leaves out that indices match their tables.
  void check_file(bool quick);
  /// Runs a query whose every row is the text of a fault.
  void check_none(const std::string& sql);

  [[nodiscard]] std::vector<std::string> take_faults() { return std::move(faults_); }

 private:
  Database* database_;
  std::vector<std::string> faults_;
};

}  // namespace gdfmap::db
