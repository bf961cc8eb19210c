#include <fstream>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/db/database.hpp>

#include "support/temporary_directory.hpp"

namespace gdfmap::db {
namespace {

namespace fs = std::filesystem;

constexpr Schema kSchema{.application_id = 0x01020304,
                         .major = 2,
                         .minor = 1,
                         .sql = "CREATE TABLE t (id INTEGER PRIMARY KEY, a, b)"};
constexpr std::size_t kCacheBytes = std::size_t{1} << 20;

class DatabaseTest : public testing::Test {
 protected:
  [[nodiscard]] fs::path path(const std::string& name = "test.db") const {
    return directory_ / name;
  }
  [[nodiscard]] Database create() const {
    Database database(path(), OpenMode::kCreate);
    prepare_schema(database, kSchema, OpenMode::kCreate);
    return database;
  }
  [[nodiscard]] fs::path write_file(const std::string& content) const {
    std::ofstream(path(), std::ios::binary) << content;
    return path();
  }

  test::TemporaryDirectory directory_;
};

template <typename Body>
Error error_of(Body&& body) {
  try {
    body();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error was thrown";
  return {ErrorCode::kInternal, ""};
}

TEST_F(DatabaseTest, RoundTripsEveryType) {
  Database database = create();
  Statement insert(database, "INSERT INTO t VALUES (NULL, ?, ?)");
  const Bytes blob{std::byte{0}, std::byte{255}, std::byte{7}};
  const Digest digest{0xfedcba9876543210, 0x8000000000000001};
  insert.bind(std::int64_t{-5}, 2.5).run();
  insert.bind(~std::uint64_t{0}, "text").run();
  insert.bind(blob, Bytes{}).run();
  insert.bind(digest, std::string("a\0b", 3)).run();
  insert.bind(std::uint32_t{4'000'000'000}, -1).run();
  EXPECT_EQ(database.last_insert_id(), 5);
  EXPECT_EQ(database.changes(), 1);

  Statement select(database, "SELECT a, b FROM t ORDER BY id");
  ASSERT_TRUE(select.step());
  EXPECT_EQ(select.integer(0), -5);
  EXPECT_EQ(select.real(1), 2.5);
  ASSERT_TRUE(select.step());
  EXPECT_EQ(static_cast<std::uint64_t>(select.integer(0)), ~std::uint64_t{0});
  EXPECT_EQ(select.text(1), "text");
  ASSERT_TRUE(select.step());
  EXPECT_TRUE(std::ranges::equal(select.blob(0), blob));
  EXPECT_FALSE(select.is_null(1));
  EXPECT_TRUE(select.blob(1).empty());
  ASSERT_TRUE(select.step());
  EXPECT_EQ(select.digest(0), digest);
  EXPECT_EQ(select.text(1), std::string("a\0b", 3));
  ASSERT_TRUE(select.step());
  EXPECT_EQ(select.integer(0), 4'000'000'000);
  EXPECT_EQ(select.integer(1), -1);
  EXPECT_FALSE(select.step());
}

TEST_F(DatabaseTest, ADigestOfAnotherLengthIsCorrupt) {
  Database database = create();
  database.execute("INSERT INTO t VALUES (1, x'0102', NULL)");
  Statement select(database, "SELECT a, b FROM t");
  ASSERT_TRUE(select.step());
  EXPECT_TRUE(select.is_null(1));
  EXPECT_EQ(error_of([&] { static_cast<void>(select.digest(0)); }).code(), ErrorCode::kCorrupt);
}

TEST_F(DatabaseTest, ATransactionThatIsNotCommittedLeavesNothing) {
  Database database = create();
  {
    Transaction transaction(database);
    database.execute("INSERT INTO t VALUES (1, 1, 1)");
  }
  EXPECT_EQ(database.query_int("SELECT count(*) FROM t"), 0);
  Transaction transaction(database);
  database.execute("INSERT INTO t VALUES (1, 1, 1)");
  transaction.commit();
  EXPECT_EQ(database.query_int("SELECT count(*) FROM t"), 1);
}

TEST_F(DatabaseTest, ARewoundQueryLetsTheWriterFoldTheLogIn) {
  Database writer = create();
  configure_writer(writer, kCacheBytes);
  writer.execute("INSERT INTO t VALUES (1, 1, 1), (2, 2, 2)");
  Database reader(path(), OpenMode::kRead);
  Statement select(reader, "SELECT a FROM t");
  {
    const RewindGuard guard(select);
    ASSERT_TRUE(select.bind().step());
    writer.execute("INSERT INTO t VALUES (3, 3, 3)");
    EXPECT_EQ(reader.query_int("SELECT count(*) FROM t"), 2);  // the snapshot of the open query
  }
  EXPECT_EQ(reader.query_int("SELECT count(*) FROM t"), 3);
}

TEST_F(DatabaseTest, AClosedWriterLeavesOnePlainFile) {
  {
    Database writer = create();
    configure_writer(writer, kCacheBytes);
    writer.execute("INSERT INTO t VALUES (1, 1, 1)");
    EXPECT_TRUE(fs::exists(path("test.db-wal")));
    close_writer(writer);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_.path()), fs::directory_iterator()), 1);
  Database reader(path(), OpenMode::kImmutable);
  EXPECT_EQ(reader.query_int("SELECT count(*) FROM t"), 1);
}

TEST_F(DatabaseTest, AReaderNeitherDelaysNorSpoilsTheClosingOfTheWriter) {
  Database reader(create().path(), OpenMode::kRead);
  {
    Database writer(path(), OpenMode::kWrite);
    configure_writer(writer, kCacheBytes);
    writer.execute("INSERT INTO t VALUES (1, 1, 1)");
    EXPECT_EQ(reader.query_int("SELECT count(*) FROM t"), 1);
    const auto start = std::chrono::steady_clock::now();
    close_writer(writer);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  }
  EXPECT_EQ(reader.query_int("SELECT count(*) FROM t"), 1);
}

TEST_F(DatabaseTest, AWriterDoesNotOverwriteDeletedRows) {
  Database writer = create();
  configure_writer(writer, kCacheBytes);
  EXPECT_EQ(writer.query_int("PRAGMA secure_delete"), 0);
  EXPECT_EQ(writer.query_int("PRAGMA page_size"), kPageBytes);
  EXPECT_EQ(writer.query_int("PRAGMA auto_vacuum"), 2);
  EXPECT_EQ(writer.query_int("PRAGMA cache_size"), -1024);
}

TEST_F(DatabaseTest, ASecondWriterIsRefusedAsBusy) {
  Database first = create();
  Database second(path(), OpenMode::kWrite);
  second.execute("PRAGMA busy_timeout = 0");
  const Transaction transaction(first);
  const Error error = error_of([&] { const Transaction other(second); });
  EXPECT_EQ(error.code(), ErrorCode::kIo);
  EXPECT_EQ(error.what(),
            path().string() + ": busy: another process is using it; try again when it is done");
}

TEST_F(DatabaseTest, AMissingFileIsAnInputErrorThatNamesThePath) {
  for (const OpenMode mode : {OpenMode::kRead, OpenMode::kWrite, OpenMode::kImmutable}) {
    const Error error = error_of([&] { const Database database(path(), mode); });
    EXPECT_EQ(error.code(), ErrorCode::kIo);
    EXPECT_NE(std::string(error.what()).find(path().string()), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("No such file"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(fs::exists(path()));
}

TEST_F(DatabaseTest, OddCharactersInAPathAreNotTakenForAnAddress) {
  const fs::path odd = path("a?mode=memory&b#c%41 \xc3\xa9.db");
  { Database(odd, OpenMode::kCreate).execute("CREATE TABLE t (a)"); }
  EXPECT_TRUE(fs::exists(odd));
  Database reader(odd, OpenMode::kImmutable);
  EXPECT_EQ(reader.query_int("SELECT count(*) FROM t"), 0);
}

TEST_F(DatabaseTest, AFileThatIsNoDatabaseIsRefused) {
  for (const std::string& content : {std::string("ply\n"), std::string(5000, 'x')}) {
    Database database(write_file(content), OpenMode::kCreate);
    const Error error = error_of([&] { prepare_schema(database, kSchema, OpenMode::kCreate); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt) << content.size();
  }
}

TEST_F(DatabaseTest, ADatabaseOfAnotherKindOrVersionIsRefused) {
  {
    Database other(path(), OpenMode::kCreate);
    other.execute("CREATE TABLE theirs (a)");
    EXPECT_NE(
        std::string(error_of([&] { prepare_schema(other, kSchema, OpenMode::kCreate); }).what())
            .find("not a database of the kind expected"),
        std::string::npos);
    other.execute("DROP TABLE theirs");
    prepare_schema(other, kSchema, OpenMode::kCreate);
    EXPECT_EQ(other.query_int("PRAGMA user_version"), 2001);
    other.execute("PRAGMA user_version = 2077");  // a newer minor version
    prepare_schema(other, kSchema, OpenMode::kRead);
    other.execute("PRAGMA user_version = 3000");
  }
  Database database(path(), OpenMode::kRead);
  const Error error = error_of([&] { prepare_schema(database, kSchema, OpenMode::kRead); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_EQ(error.what(), path().string() + " has format version 3, this build reads version 2");
}

constexpr const char* kMigrations[] = {"ALTER TABLE t ADD COLUMN c; ALTER TABLE t ADD COLUMN d",
                                       "ALTER TABLE t ADD COLUMN e"};
constexpr Schema newer(std::span<const char* const> migrations) {
  return {kSchema.application_id, kSchema.major, 2, kSchema.sql, migrations};
}

TEST_F(DatabaseTest, AWriterBringsAnOlderMinorVersionUpToDateAndAReaderDoesNot) {
  create().execute("PRAGMA user_version = 2000; INSERT INTO t VALUES (1, 2, 3)");
  const Schema schema = newer(kMigrations);
  Database reader(path(), OpenMode::kRead);
  EXPECT_EQ(prepare_schema(reader, schema, OpenMode::kRead), 0);
  EXPECT_THROW(reader.query_int("SELECT count(c) FROM t"), Error);

  Database writer(path(), OpenMode::kWrite);
  EXPECT_EQ(prepare_schema(writer, schema, OpenMode::kWrite), 2);
  EXPECT_EQ(writer.query_int("PRAGMA user_version"), 2002);
  EXPECT_EQ(writer.query_int("SELECT a + b FROM t WHERE c IS NULL AND d IS NULL AND e IS NULL"), 5);
  EXPECT_EQ(prepare_schema(writer, schema, OpenMode::kWrite), 2);
}

TEST_F(DatabaseTest, AMigrationThatFailsLeavesTheOlderVersion) {
  create().execute("PRAGMA user_version = 2000");
  constexpr const char* kFailing[] = {"ALTER TABLE t ADD COLUMN c",
                                      "ALTER TABLE none ADD COLUMN e"};
  {
    Database writer(path(), OpenMode::kWrite);
    EXPECT_THROW(prepare_schema(writer, newer(kFailing), OpenMode::kWrite), Error);
  }
  Database reader(path(), OpenMode::kRead);
  EXPECT_EQ(reader.query_int("PRAGMA user_version"), 2000);
  EXPECT_THROW(reader.query_int("SELECT count(c) FROM t"), Error);
}

TEST_F(DatabaseTest, OnlyCreateFillsAnEmptyFile) {
  Database database(write_file(""), OpenMode::kWrite);
  EXPECT_EQ(error_of([&] { prepare_schema(database, kSchema, OpenMode::kWrite); }).code(),
            ErrorCode::kCorrupt);
}

TEST_F(DatabaseTest, AReaderCannotWrite) {
  static_cast<void>(create());
  Database reader(path(), OpenMode::kRead);
  EXPECT_EQ(error_of([&] { reader.execute("INSERT INTO t VALUES (1, 1, 1)"); }).code(),
            ErrorCode::kIo);
}

/// Runs `body` in a child that may not write the directory, also when the tests run as root.
bool holds_without_permission(const fs::path& directory, bool (*body)(const fs::path&)) {
  fs::permissions(directory, fs::perms(0555));
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    const bool dropped = ::getuid() != 0 || ::setresuid(kNobody, kNobody, kNobody) == 0;
    ::_exit(dropped && body(directory) ? 0 : 1);
  }
  int status = 1;
  ::waitpid(child, &status, 0);
  fs::permissions(directory, fs::perms(0755));
  return status == 0;
}

TEST_F(DatabaseTest, AMapAtRestIsReadWhereNothingCanBeWritten) {
  create().execute("INSERT INTO t VALUES (1, 1, 1)");
  EXPECT_EQ(reading_mode(path()), OpenMode::kRead);
  EXPECT_TRUE(holds_without_permission(directory_.path(), [](const fs::path& directory) {
    const fs::path file = directory / "test.db";
    if (reading_mode(file) != OpenMode::kImmutable) return false;
    Database reader(file, OpenMode::kImmutable);
    return reader.query_int("SELECT count(*) FROM t") == 1;
  }));
}

TEST_F(DatabaseTest, ALeftoverLogWhereNothingCanBeWrittenIsRefused) {
  static_cast<void>(create());
  std::ofstream(path("test.db-wal")) << "rows";
  EXPECT_TRUE(holds_without_permission(directory_.path(), [](const fs::path& directory) {
    try {
      static_cast<void>(reading_mode(directory / "test.db"));
    } catch (const Error& error) {
      return error.code() == ErrorCode::kIo &&
             std::string(error.what()).find("test.db-wal") != std::string::npos;
    }
    return false;
  }));
}

TEST_F(DatabaseTest, ARelativePathIsReadFromItsOwnDirectory) {
  static_cast<void>(create());
  const fs::path before = fs::current_path();
  fs::current_path(directory_.path());
  const OpenMode mode = reading_mode("test.db");
  fs::current_path(before);
  EXPECT_EQ(mode, OpenMode::kRead);
}

}  // namespace
}  // namespace gdfmap::db
