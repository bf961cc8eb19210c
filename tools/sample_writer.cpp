#include "sample_writer.hpp"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <vector>

#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/npy.hpp>

#include "output.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr std::size_t kNumColumns = 9;
constexpr std::array<const char*, kNumColumns> kColumns = {
    "x", "y", "z", "distance", "gx", "gy", "gz", "status", "expected_error"};
constexpr std::size_t kStatusColumn = 7;
constexpr int kDigits = 9;  // the parameters are float32: more would be noise

/// A row as numbers, in the order of the columns.
using Row = std::array<double, kNumColumns>;

Row row_of(const Vector3& p, const FieldSample& s) {
  return {p.x(),           p.y(),          p.z(),          s.distance,
          s.gradient.x(),  s.gradient.y(), s.gradient.z(), static_cast<double>(s.status),
          s.expected_error};
}

/// A cell as text: coordinates as they were given, what was computed to kDigits.
std::string cell(const Row& row, std::size_t column) {
  if (std::isnan(row[column])) return "nan";  // without the sign that printf gives some of them
  return column < 3 ? exact(row[column]) : rounded(row[column], kDigits);
}

class CsvWriter : public SampleWriter {
 public:
  CsvWriter() {
    for (const char* name : kColumns) text_ += (text_.empty() ? "" : ",") + std::string(name);
    text_ += '\n';
  }

  void write(std::span<const Vector3> points_world, std::span<const FieldSample> samples) override {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Row row = row_of(points_world[i], samples[i]);
      for (std::size_t column = 0; column < kNumColumns; ++column) {
        if (column > 0) text_ += ',';
        text_ += column == kStatusColumn ? status_name(samples[i].status) : cell(row, column);
      }
      text_ += '\n';
    }
    finish();
  }

  void finish() override {
    write_output(text_);
    text_.clear();
  }

 private:
  std::string text_;  ///< the header, until the first batch
};

/// One array of objects, an object a line.
class JsonWriter : public SampleWriter {
 public:
  void write(std::span<const Vector3> points_world, std::span<const FieldSample> samples) override {
    std::string text;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      text += empty_ ? "[\n" : ",\n";
      empty_ = false;
      append_object(points_world[i], samples[i], text);
    }
    write_output(text);
  }

  void finish() override { write_output(empty_ ? "[]\n" : "\n]\n"); }

 private:
  static void append_object(const Vector3& p_world, const FieldSample& sample, std::string& text) {
    const Row row = row_of(p_world, sample);
    for (std::size_t column = 0; column < kNumColumns; ++column) {
      text += (column == 0 ? "{\"" : ", \"") + std::string(kColumns[column]) + "\": ";
      if (column == kStatusColumn) {
        text += '"' + std::string(status_name(sample.status)) + '"';
      } else {
        text += std::isfinite(row[column]) ? cell(row, column) : "null";
      }
    }
    text += '}';
  }

  bool empty_ = true;
};

/// Keeps the rows in a temporary file: the header in front of them states their number.
class NpyWriter : public SampleWriter {
 public:
  NpyWriter() : rows_(std::tmpfile()) {
    if (!rows_) fail();
  }

  void write(std::span<const Vector3> points_world, std::span<const FieldSample> samples) override {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Row row = row_of(points_world[i], samples[i]);
      if (std::fwrite(row.data(), sizeof(row), 1, rows_.get()) != 1) fail();
    }
    num_rows_ += samples.size();
  }

  void finish() override {
    if (std::fflush(rows_.get()) != 0) fail();
    write_output(npy_header_float64({num_rows_, kNumColumns}));
    std::rewind(rows_.get());
    std::array<char, std::size_t{1} << 16> buffer;
    while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), rows_.get())) {
      write_output({buffer.data(), count});
    }
    if (std::ferror(rows_.get()) != 0) fail();
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  [[noreturn]] static void fail() {
    throw Error(ErrorCode::kIo,
                "temporary file for npy: " + std::generic_category().message(errno));
  }

  std::unique_ptr<std::FILE, Close> rows_;
  std::size_t num_rows_ = 0;
};

}  // namespace

const char* status_name(FieldStatus status) {
  switch (status) {
    case FieldStatus::kFine:
      return "fine";
    case FieldStatus::kCoarse:
      return "coarse";
    case FieldStatus::kFar:
      return "far";
    case FieldStatus::kPending:
      return "pending";
    case FieldStatus::kUnknown:
      break;
  }
  return "unknown";
}

std::unique_ptr<SampleWriter> make_sample_writer(const std::string& format) {
  if (format == "csv") return std::make_unique<CsvWriter>();
  if (format == "json") return std::make_unique<JsonWriter>();
  if (::isatty(STDOUT_FILENO) == 1) {
    throw Error(ErrorCode::kUsage, "npy is binary: redirect it to a file");
  }
  return std::make_unique<NpyWriter>();
}

}  // namespace gdfmap::cli
