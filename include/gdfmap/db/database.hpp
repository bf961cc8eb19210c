#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <gdfmap/core/bytes.hpp>

struct sqlite3;
struct sqlite3_stmt;

namespace gdfmap::db {

/// Of databases that are made. Half of a page is lost at the end of every blob, and a whole one in
/// every table that is nearly empty.
inline constexpr int kPageBytes = 4096;

/// How a database file is opened.
enum class OpenMode {
  kCreate,    ///< read and write, created when missing
  kWrite,     ///< read and write, must exist
  kRead,      ///< read only, beside a possible writer
  kImmutable  ///< read only on a medium that nobody can write: no locks, no side files
};

/// One SQLite connection. Not thread-safe: one connection per thread.
/// @throws Error kIo (missing, busy, no permission, disk full) or kCorrupt (not a database,
/// damaged),
///         with the path, from every member; kInternal for SQL that does not fit the schema.
class Database {
 public:
  Database(const std::filesystem::path& path, OpenMode mode);

  /// Runs one or more statements without results.
  void execute(const std::string& sql);
  /// First column of the first row of a query, which must have one.
  [[nodiscard]] std::int64_t query_int(const std::string& sql);
  [[nodiscard]] std::string query_text(const std::string& sql);

  [[nodiscard]] std::int64_t last_insert_id() const;
  /// Rows that the last INSERT, UPDATE or DELETE changed.
  [[nodiscard]] std::int64_t changes() const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  friend class Statement;
  struct Close {
    void operator()(sqlite3* handle) const;
  };

  std::filesystem::path path_;
  std::unique_ptr<sqlite3, Close> handle_;
};

/// A prepared statement of a connection that outlives it. Parameters count from 1, columns from 0.
///
///     Statement insert(database, "INSERT INTO t VALUES (?, ?)");
///     insert.bind(7, "seven").run();
///
///     Statement select(database, "SELECT a FROM t WHERE b = ?");
///     for (select.bind("seven"); select.step();) use(select.integer(0));
class Statement {
 public:
  Statement(Database& database, const std::string& sql);

  /// Rewinds the statement and binds its first parameters in order. Text and bytes are copied.
  template <typename... Values>
  Statement& bind(const Values&... values) {
    rewind();
    [[maybe_unused]] int index = 0;
    (bind_one(++index, values), ...);
    return *this;
  }

  /// Moves to the next row; false (and rewound) after the last one.
  bool step();
  /// Ends a query before its last row; an open query keeps its snapshot, and with it the log,
  /// alive.
  void rewind();
  /// For statements without rows: steps to the end.
  void run();

  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string text(int column) const;
  /// Valid until the next step, bind or destruction.
  [[nodiscard]] std::span<const std::byte> blob(int column) const;
  [[nodiscard]] Digest digest(int column) const;  ///< @throws Error kCorrupt unless 16 bytes
  [[nodiscard]] bool is_null(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };

  void bind_one(int index, std::int64_t value);
  void bind_one(int index, int value) { bind_one(index, std::int64_t{value}); }
  void bind_one(int index, std::uint32_t value) { bind_one(index, std::int64_t{value}); }
  void bind_one(int index, std::uint64_t value) {
    bind_one(index, static_cast<std::int64_t>(value));
  }
  void bind_one(int index, double value);
  void bind_one(int index, const std::optional<double>& value);  ///< empty: NULL
  void bind_one(int index, std::string_view value);
  void bind_one(int index, const char* value) { bind_one(index, std::string_view(value)); }
  void bind_one(int index, const std::string& value) { bind_one(index, std::string_view(value)); }
  void bind_one(int index, std::span<const std::byte> value);
  void bind_one(int index, const Bytes& value) { bind_one(index, std::span(value)); }
  void bind_one(int index, const Digest& value);
  void check(int code) const;

  Database* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// Rewinds a statement that lives longer than one use of it, however that use ends.
class RewindGuard {
 public:
  explicit RewindGuard(Statement& statement) : statement_(&statement) {}
  ~RewindGuard() { statement_->rewind(); }
  RewindGuard(const RewindGuard&) = delete;
  RewindGuard& operator=(const RewindGuard&) = delete;

 private:
  Statement* statement_;
};

/// BEGIN IMMEDIATE … COMMIT; rolled back when destroyed without commit().
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  void commit();

 private:
  Database* database_;
  bool open_ = true;
};

/// What tells one kind of database file from another (SQLite's application_id and user_version).
struct Schema {
  std::int32_t application_id;
  int major;        ///< a different one is refused
  int minor;        ///< an older one is migrated by a writer, a newer one is read as it is
  const char* sql;  ///< creates every table
  /// migrations[n] makes minor version n + 1 of version n, with one or more statements.
  std::span<const char* const> migrations = {};
};

/// Creates the schema in an empty file, or checks the one that is there; a writer brings an older
/// minor version up to date, in one transaction. Returns the minor version that the file then has:
/// to a reader it may be an older one.
/// @throws Error kCorrupt when the file is of another kind, of an unknown major version, or lacks a
///         table of the schema.
int prepare_schema(Database& database, const Schema& schema, OpenMode mode);

/// kRead where the directory of the file can be written, else kImmutable.
/// @throws Error kIo when a -wal or -journal stands beside the file in a directory that cannot be
///         written: its rows would be passed over.
[[nodiscard]] OpenMode reading_mode(const std::filesystem::path& path);

/// Settings of a connection that writes: WAL, synchronous NORMAL, page cache bounded to
/// cache_bytes.
void configure_writer(Database& database, std::size_t cache_bytes);
/// Folds the write-ahead log into the file and leaves one plain file. No statement may be open.
/// Best effort and without waiting: a reader that still holds the log keeps it, which loses
/// nothing.
void close_writer(Database& database) noexcept;

}  // namespace gdfmap::db
