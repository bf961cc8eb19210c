#include <algorithm>

#include <gdfmap/db/verification.hpp>

namespace gdfmap::db {

Verification::Verification(Database& database) : database_(&database) { database.execute("BEGIN"); }

Verification::~Verification() {
  try {
    database_->execute("ROLLBACK");
  } catch (const Error&) {
    // SQLite has ended the transaction by itself; it only read.
  }
}

void Verification::add(const std::string& fault) {
  const std::string path = database_->path().string();
  std::string line = fault.starts_with(path) ? fault : path + ": " + fault;
  std::ranges::replace(line, '\n', ' ');  // SQLite's own findings may have several
  faults_.push_back(std::move(line));
}

void Verification::check_file(bool quick) {
  run([&] {
    Statement check(*database_, quick ? "PRAGMA quick_check" : "PRAGMA integrity_check");
    while (check.step()) {
      if (const std::string line = check.text(0); line != "ok") add(line);
    }
  });
}

void Verification::check_none(const std::string& sql) {
  run([&] {
    Statement select(*database_, sql);
    while (select.step()) add(select.text(0));
  });
}

}  // namespace gdfmap::db
