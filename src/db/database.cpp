#include <new>
#include <system_error>

#include <sqlite3.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/db/database.hpp>

namespace gdfmap::db {
namespace {

constexpr int kBusyTimeoutMs = 10'000;

ErrorCode error_code(int sqlite_code) {
  switch (sqlite_code & 0xff) {
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return ErrorCode::kCorrupt;
    case SQLITE_MISUSE:
    case SQLITE_CONSTRAINT:
    case SQLITE_RANGE:
    case SQLITE_ERROR:
      return ErrorCode::kInternal;
    default:
      return ErrorCode::kIo;
  }
}

[[noreturn]] void throw_error(sqlite3* handle, int code, const std::filesystem::path& path) {
  const int primary = code & 0xff;
  if (primary == SQLITE_NOMEM || handle == nullptr) throw std::bad_alloc();
  std::string message = path.string() + ": " + sqlite3_errmsg(handle);
  if (primary == SQLITE_BUSY) {
    message = path.string() + ": busy: another process is using it; try again when it is done";
  }
  const int system_error = sqlite3_system_errno(handle);
  if (system_error != 0 && (primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN)) {
    message += " (" + std::generic_category().message(system_error) + ")";
  }
  throw Error(error_code(code), message);
}

int open_flags(OpenMode mode) {
  switch (mode) {
    case OpenMode::kCreate:
      return SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
    case OpenMode::kWrite:
      return SQLITE_OPEN_READWRITE;
    case OpenMode::kRead:
    case OpenMode::kImmutable:
      break;
  }
  return SQLITE_OPEN_READONLY;
}

/// SQLite's URI form of a path, so that immutable=1 can be said; every special byte is escaped.
std::string file_uri(const std::filesystem::path& path, OpenMode mode) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '%' || c == '?' || c == '#' || byte < 0x20 || byte > 0x7e) {
      uri += {'%', kHex[byte >> 4], kHex[byte & 15]};
    } else {
      uri += c;
    }
  }
  return mode == OpenMode::kImmutable ? uri + "?immutable=1" : uri;
}

/// Version and application id alone do not make a database whole.
void check_tables(Database& database, std::string_view sql) {
  constexpr std::string_view kStart = "CREATE TABLE ";
  Statement count(database, "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name = ?");
  for (std::size_t at = sql.find(kStart); at != std::string_view::npos; at = sql.find(kStart, at)) {
    at += kStart.size();
    const std::string_view name = sql.substr(at, sql.find(' ', at) - at);
    count.bind(name).step();
    if (count.integer(0) != 1) {
      throw Error(ErrorCode::kCorrupt,
                  database.path().string() + ": table " + std::string(name) + " is missing");
    }
  }
}

constexpr int kMinorsPerMajor = 1000;

void set_version(Database& database, int major, int minor) {
  database.execute("PRAGMA user_version = " + std::to_string(major * kMinorsPerMajor + minor));
}

void create_schema(Database& database, const Schema& schema) {
  database.execute("PRAGMA page_size = " + std::to_string(kPageBytes) +
                   "; PRAGMA auto_vacuum = INCREMENTAL");
  Transaction transaction(database);
  database.execute(schema.sql);
  database.execute("PRAGMA application_id = " + std::to_string(schema.application_id));
  set_version(database, schema.major, schema.minor);
  transaction.commit();
}

void migrate(Database& database, const Schema& schema, int minor) {
  Transaction transaction(database);
  for (const char* const sql : schema.migrations.subspan(static_cast<std::size_t>(minor))) {
    database.execute(sql);
  }
  set_version(database, schema.major, schema.minor);
  transaction.commit();
}

}  // namespace

void Database::Close::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }

Database::Database(const std::filesystem::path& path, OpenMode mode) : path_(path) {
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(file_uri(path, mode).c_str(), &handle,
                      open_flags(mode) | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) throw_error(handle, code, path_);
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyTimeoutMs);
}

void Database::execute(const std::string& sql) {
  const int code = sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) throw_error(handle_.get(), code, path_);
}

std::int64_t Database::query_int(const std::string& sql) {
  Statement statement(*this, sql);
  if (!statement.step()) throw Error(ErrorCode::kCorrupt, path_.string() + ": no row for " + sql);
  return statement.integer(0);
}

std::string Database::query_text(const std::string& sql) {
  Statement statement(*this, sql);
  if (!statement.step()) throw Error(ErrorCode::kCorrupt, path_.string() + ": no row for " + sql);
  return statement.text(0);
}

std::int64_t Database::last_insert_id() const { return sqlite3_last_insert_rowid(handle_.get()); }

std::int64_t Database::changes() const { return sqlite3_changes64(handle_.get()); }

void Statement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Statement::Statement(Database& database, const std::string& sql) : database_(&database) {
  sqlite3_stmt* statement = nullptr;
  check(sqlite3_prepare_v2(database.handle_.get(), sql.c_str(), static_cast<int>(sql.size()),
                           &statement, nullptr));
  statement_.reset(statement);
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) {
    // Rewinding would replace the connection's message.
    check(code);
  }
  rewind();
  return false;
}

void Statement::run() {
  while (step()) {
  }
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const { return sqlite3_column_double(statement_.get(), column); }

std::string Statement::text(int column) const {
  // The bytes are counted after the conversion to text, which may change their number.
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  const auto bytes = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return text == nullptr ? std::string() : std::string(text, bytes);
}

std::span<const std::byte> Statement::blob(int column) const {
  const auto* data = static_cast<const std::byte*>(sqlite3_column_blob(statement_.get(), column));
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

Digest Statement::digest(int column) const {
  const auto bytes = blob(column);
  if (bytes.size() != 16) {
    throw Error(ErrorCode::kCorrupt, database_->path().string() + ": a digest is not 16 bytes");
  }
  return {load<std::uint64_t>(bytes.data()), load<std::uint64_t>(bytes.data() + 8)};
}

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

void Statement::rewind() { sqlite3_reset(statement_.get()); }

void Statement::bind_one(int index, std::int64_t value) {
  check(sqlite3_bind_int64(statement_.get(), index, value));
}

void Statement::bind_one(int index, double value) {
  check(sqlite3_bind_double(statement_.get(), index, value));
}

void Statement::bind_one(int index, const std::optional<double>& value) {
  if (value) {
    bind_one(index, *value);
  } else {
    check(sqlite3_bind_null(statement_.get(), index));
  }
}

void Statement::bind_one(int index, std::string_view value) {
  check(sqlite3_bind_text64(statement_.get(), index, value.data(), value.size(), SQLITE_TRANSIENT,
                            SQLITE_UTF8));
}

void Statement::bind_one(int index, std::span<const std::byte> value) {
  // A null pointer would bind NULL instead of an empty blob.
  const void* const data = value.empty() ? "" : static_cast<const void*>(value.data());
  check(sqlite3_bind_blob64(statement_.get(), index, data, value.size(), SQLITE_TRANSIENT));
}

void Statement::bind_one(int index, const Digest& value) {
  ByteWriter writer;
  writer.put(value);
  bind_one(index, writer.bytes());
}

void Statement::check(int code) const {
  if (code != SQLITE_OK) throw_error(database_->handle_.get(), code, database_->path());
}

Transaction::Transaction(Database& database) : database_(&database) {
  database.execute("BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  if (!open_) return;
  try {
    database_->execute("ROLLBACK");
  } catch (const Error&) {
    // SQLite has rolled back by itself (disk full, I/O error); nothing is left to undo.
  }
}

void Transaction::commit() {
  database_->execute("COMMIT");
  open_ = false;
}

int prepare_schema(Database& database, const Schema& schema, OpenMode mode) {
  const std::string name = database.path().string();
  const std::int64_t id = database.query_int("PRAGMA application_id");
  const std::int64_t version = database.query_int("PRAGMA user_version");
  const bool empty = id == 0 && database.query_int("SELECT count(*) FROM sqlite_master") == 0;
  if (empty && mode == OpenMode::kCreate) {
    create_schema(database, schema);
    return schema.minor;
  }
  if (id != schema.application_id) {
    throw Error(ErrorCode::kCorrupt, name + " is not a database of the kind expected here");
  }
  if (version / kMinorsPerMajor != schema.major) {
    throw Error(ErrorCode::kCorrupt,
                name + " has format version " + std::to_string(version / kMinorsPerMajor) +
                    ", this build reads version " + std::to_string(schema.major));
  }
  check_tables(database, schema.sql);
  const int minor = static_cast<int>(version % kMinorsPerMajor);
  const bool writes = mode == OpenMode::kCreate || mode == OpenMode::kWrite;
  if (!writes || minor >= schema.minor) return minor;
  migrate(database, schema, minor);
  return schema.minor;
}

OpenMode reading_mode(const std::filesystem::path& path) {
  const std::filesystem::path directory = std::filesystem::absolute(path).parent_path();
  if (::access(directory.c_str(), W_OK) == 0) return OpenMode::kRead;
  for (const char* const suffix : {"-wal", "-journal"}) {
    std::error_code ignored;
    if (!std::filesystem::exists(path.string() + suffix, ignored)) continue;
    throw Error(
        ErrorCode::kIo,
        path.string() + suffix +
            " was left by a writer in a directory that cannot be written here; wait for the "
            "writer, or open the map for writing once where that is possible");
  }
  return OpenMode::kImmutable;
}

void configure_writer(Database& database, std::size_t cache_bytes) {
  static_cast<void>(database.query_text("PRAGMA journal_mode = WAL"));
  // Overwriting deleted rows with zeros, the default of some distributions, would write every
  // discarded block a second time.
  static_cast<void>(database.query_int("PRAGMA secure_delete = OFF"));
  database.execute("PRAGMA synchronous = NORMAL; PRAGMA temp_store = FILE; PRAGMA cache_size = -" +
                   std::to_string(cache_bytes / 1024));
}

void close_writer(Database& database) noexcept {
  try {
    // A reader that is still connected is no reason to wait: it keeps the log, which the next
    // writer folds in, but most often its pages can be moved into the file already.
    database.execute("PRAGMA busy_timeout = 0; PRAGMA wal_checkpoint(TRUNCATE)");
    static_cast<void>(database.query_text("PRAGMA journal_mode = DELETE"));
  } catch (const std::exception&) {
    // The log stays; nothing is lost.
  }
}

}  // namespace gdfmap::db
