#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <utility>

#include <gdfmap/core/error.hpp>
#include <gdfmap/tiling/ingest.hpp>

#include "block_pipeline.hpp"
#include "block_stager.hpp"
#include "ingest_options.hpp"
#include "read_ahead.hpp"

namespace gdfmap {
namespace {

constexpr std::size_t kBytesPerRead = std::size_t{1} << 20;
/// Everything that is not a point buffer: a quarter of the budget for the blocks in the making and
/// SQLite's page cache, which grow with it, and a fixed part for the program and the reader.
constexpr std::size_t kReservedBytes = std::size_t{16} << 20;
constexpr std::size_t kReservedShare = 4;
/// What a thread that makes blocks takes at most: batches that wait, one in the making, blocks.
constexpr std::size_t kBytesPerThread = std::size_t{8} << 20;
constexpr double kWarnZeroRatio = 0.01;
/// What clouds of a usual density take (BENCHMARK.md), and SQLite's log at its longest.
constexpr double kDiskBytesPerPoint = 4.0;
constexpr double kMaxLogBytes = 20.0 * (1 << 20);

Digest source_identity(const Digest& file, const std::string& parameters) {
  ByteWriter writer;
  writer.put(file);
  writer.put_bytes(std::as_bytes(std::span(parameters)));
  return hash128(writer.bytes());
}

bool is_published(PointStore& store, std::int64_t id) {
  const std::vector<SourceRecord> sources = store.sources();
  return std::any_of(sources.begin(), sources.end(),
                     [&](const SourceRecord& source) { return source.id == id; });
}

void check_replaced(const IngestOptions& options, PointStore& store) {
  const auto replaced = options.replaced_source;
  if (!replaced || is_published(store, *replaced)) return;
  throw Error(ErrorCode::kUsage, "there is no source " + std::to_string(*replaced) +
                                     " to replace; `gdfmap sources` lists them");
}

/// Half-open, so that regions that share a face share no point.
bool contains(const Box3& region, const Vector3& p) {
  return (p.array() >= region.min().array()).all() && (p.array() < region.max().array()).all();
}

/// Bytes for point buffers out of the budget of the process, whatever the threads: what becomes a
/// block, and with it the counts, depends on them.
std::size_t buffer_bytes(const RunContext& context) {
  if (context.memory() < kMinMemoryBytes) {
    throw Error(ErrorCode::kUsage, "a memory budget of " + std::to_string(context.memory()) +
                                       " bytes is below the least, " +
                                       std::to_string(kMinMemoryBytes));
  }
  return context.memory() - context.memory() / kReservedShare - kReservedBytes;
}

int num_block_threads(const RunContext& context) {
  const std::size_t room = context.memory() / kReservedShare / kBytesPerThread;
  return std::min(context.threads(), static_cast<int>(std::max<std::size_t>(room, 1)));
}

/// Hash of a file's bytes, as PointReader::identity() gives it.
Digest hash_file(const std::string& path, std::uint64_t num_bytes, const RunContext& context) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> buffer(kBytesPerRead);
  StreamHasher hasher;
  std::uint64_t done = 0;
  while (file) {
    context.throw_if_stopped();
    file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    const auto count = static_cast<std::size_t>(file.gcount());
    hasher.update(std::as_bytes(std::span(buffer).first(count)));
    done += count;
    context.progress({.stage = "bytes", .done = done, .total = num_bytes, .detail = {}});
  }
  if (!file.eof()) throw Error(ErrorCode::kIo, path + ": cannot be read");
  return hasher.digest();
}

/// One cloud on its way into the store.
class Ingest {
 public:
  Ingest(PointReader& reader, const Lattice& lattice, const IngestOptions& options,
         BlockStager& stager, const RunContext& context)
      : reader_(&reader),
        lattice_(&lattice),
        options_(&options),
        transform_(options.aligned_transform()),
        stager_(&stager),
        context_(&context) {}

  /// Stages every point and returns how many were read and rejected.
  IngestCounts run() {
    ReadAhead read_ahead(*reader_);
    for (auto points = read_ahead.next(); !points.empty(); points = read_ahead.next()) {
      context_->throw_if_stopped();
      for (const Vector3& p_source : points) add(p_source);
      num_delivered_ += points.size();
      context_->progress({.stage = "points",
                          .done = num_delivered_,
                          .total = reader_->info().num_points.value_or(0),
                          .detail = {},
                          .fraction = read_ahead.fraction_read().value_or(-1.0)});
    }
    context_->throw_if_stopped();
    stager_->finish();
    counts_.num_rejected_withheld = reader_->num_withheld();
    counts_.num_read = num_delivered_ + counts_.num_rejected_withheld;
    return counts_;
  }

  [[nodiscard]] std::uint64_t num_zero() const { return num_zero_; }

 private:
  void add(const Vector3& p_source) {
    if (!p_source.allFinite()) {
      ++counts_.num_rejected_not_finite;
      return;
    }
    if (p_source.isZero(0.0)) {
      ++num_zero_;
      if (options_->drop_zero) {
        ++counts_.num_rejected_zero;
        return;
      }
    }
    const Vector3 p_map = transform_.apply(p_source);
    const auto p = lattice_->quantize(p_map);
    if (!p) {
      ++counts_.num_rejected_out_of_range;
    } else if (options_->region && !contains(*options_->region, p_map)) {
      ++counts_.num_rejected_outside;
    } else {
      stager_->add(*p);
    }
  }

  PointReader* reader_;
  const Lattice* lattice_;
  const IngestOptions* options_;
  PointTransform transform_;
  BlockStager* stager_;
  const RunContext* context_;
  IngestCounts counts_;
  std::uint64_t num_delivered_ = 0;
  std::uint64_t num_zero_ = 0;
};

/// Refuses, before hours are spent, a cloud for which there is no room: where its number of points
/// is known, and none but damaged ones are left out.
void check_disk(const PointReader& reader, const std::string& path, const PointStore& store,
                const IngestOptions& options) {
  const auto num_points = reader.info().num_points;
  if (!num_points || options.region || options.voxel_size != 0.0) return;
  const double data = kDiskBytesPerPoint * static_cast<double>(*num_points);
  const double needed = data + std::min(data, kMaxLogBytes);
  std::error_code error;
  const std::filesystem::path directory = std::filesystem::absolute(store.path()).parent_path();
  const std::filesystem::space_info space = std::filesystem::space(directory, error);
  // The log stays as long as it ever was while the store is open, and is used again.
  std::error_code no_log;
  const std::uintmax_t log = std::filesystem::file_size(store.path().string() + "-wal", no_log);
  const double room =
      static_cast<double>(space.available) + (no_log ? 0.0 : static_cast<double>(log));
  if (error || needed <= room) return;
  const auto mebibytes = [](double bytes) {
    return std::to_string(static_cast<std::uint64_t>(bytes / (1 << 20)) + 1) + " MiB";
  };
  throw Error(ErrorCode::kIo, path + ": its " + std::to_string(*num_points) +
                                  " points need about " + mebibytes(needed) + " on the disk of " +
                                  directory.string() + ", where less than " + mebibytes(room) +
                                  " are free");
}

void warn_of_zeros(const std::string& path, const IngestReport& report,
                   const IngestOptions& options, const RunContext& context) {
  const double ratio =
      static_cast<double>(report.num_zero) /
      static_cast<double>(std::max<std::uint64_t>(1, report.source.counts.num_read));
  if (options.drop_zero || ratio <= kWarnZeroRatio) return;
  std::array<char, 16> percent;
  std::snprintf(percent.data(), percent.size(), "%.1f", 100.0 * ratio);
  context.warn(
      path + ": " + percent.data() + " % of the points (" + std::to_string(report.num_zero) +
      ") are exactly (0, 0, 0), as scanners mark a missing return; --drop-zero leaves them "
      "out");
}

void warn_of_rotation(const PointReader& reader, const std::string& path,
                      const IngestOptions& options, const RunContext& context) {
  if (!reader.info().has_sensor_rotation || options.sensor_origin_source) return;
  context.warn(path +
               ": the file states how the sensor was turned; its points are taken as they stand "
               "(--transform and --poses turn them)");
}

void discard_quietly(PointStore& store, std::int64_t source) {
  try {
    store.discard(source);
  } catch (const std::exception&) {
    // The next writer deletes what is left; the first error, if any, is the one to tell.
  }
}

/// Stages the points of a cloud as those of the source begun, and counts them in the report.
void stage_points(PointReader& reader, const Lattice& lattice, PointStore& store,
                  const IngestOptions& options, const RunContext& context, IngestReport& report) {
  SourceRecord& source = report.source;
  BlockPipeline pipeline(store, source.id, source.voxel_steps, num_block_threads(context));
  BlockStager stager(pipeline, buffer_bytes(context));
  Ingest ingest(reader, lattice, options, stager, context);
  source.counts = ingest.run();
  pipeline.finish();
  context.throw_if_stopped();
  source.counts.num_stored = pipeline.num_stored();
  source.counts.num_duplicates = pipeline.num_duplicates();
  source.counts.num_thinned = pipeline.num_thinned();
  report.num_zero = ingest.num_zero();
}

/// In the map's frame: where somebody says that the sensor stood, else where the file says it.
std::optional<Vector3> sensor_origin(const CloudInfo& info, const IngestOptions& options) {
  const auto p_source =
      options.sensor_origin_source ? options.sensor_origin_source : info.sensor_origin;
  if (!p_source) return std::nullopt;
  return options.aligned_transform().apply(*p_source);
}

/// What a source that is there already answers to the same cloud again. Where the sensor stood may
/// be told later; of an aligned cloud only registration knows it.
IngestReport report_of_known(SourceRecord known, const IngestOptions& options) {
  IngestReport report{.source = std::move(known), .already_present = true};
  if (!options.sensor_origin_source || options.alignment) return report;
  const Vector3 origin = options.transform.apply(*options.sensor_origin_source);
  report.sensor_origin_changed = report.source.sensor_origin != origin;
  report.source.sensor_origin = origin;
  return report;
}

}  // namespace

std::optional<SourceRecord> find_published(const std::string& path, const IngestOptions& options,
                                           PointStore& store, const RunContext& context) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  const std::uintmax_t num_bytes = std::filesystem::file_size(path, error);
  if (error || !store.has_source_of_size(num_bytes)) return std::nullopt;
  return store.find_source(
      source_identity(hash_file(path, num_bytes, context), options.canonical()));
}

SurveyIngest::~SurveyIngest() {
  for (const IngestReport& report : reports_) {
    if (!report.already_present) discard_quietly(*store_, report.source.id);
  }
}

std::optional<SourceRecord> SurveyIngest::find(const Digest& identity) const {
  for (const IngestReport& report : reports_) {
    if (report.source.identity == identity) return report.source;
  }
  return store_->find_source(identity);
}

void SurveyIngest::stage(PointReader& reader, const std::string& path,
                         const IngestOptions& options) {
  check_options(options, *lattice_);
  replaced_ = options.replaced_source;
  if (auto known = find_published(path, options, *store_, *context_)) {
    reports_.push_back(report_of_known(std::move(*known), options));
    return;
  }
  check_replaced(options, *store_);
  check_disk(reader, path, *store_, options);
  warn_of_rotation(reader, path, options, *context_);

  SourceRecord source;
  source.path = path;
  source.parameters = options.canonical();
  source.voxel_steps = voxel_steps(options, *lattice_);
  source.sensor_origin = sensor_origin(reader.info(), options);
  if (options.alignment) source.alignment = options.alignment->text();
  source.id = store_->begin_source(path, source.parameters, source.voxel_steps);
  reports_.push_back({.source = std::move(source)});

  IngestReport& report = reports_.back();
  stage_points(reader, *lattice_, *store_, options, *context_, report);
  const Digest identity = source_identity(reader.identity(), report.source.parameters);
  if (auto known = find(identity)) {
    store_->discard(report.source.id);
    report = report_of_known(std::move(*known), options);
    return;
  }
  report.source.identity = identity;
  report.source.num_bytes = reader.num_bytes();
  warn_of_zeros(path, report, options, *context_);
}

std::vector<IngestReport> SurveyIngest::publish() {
  std::vector<SourceRecord> staged;
  for (const IngestReport& report : reports_) {
    if (!report.already_present) staged.push_back(report.source);
  }
  if (!staged.empty()) {
    store_->publish(staged, replaced_);
    if (replaced_) discard_quietly(*store_, *replaced_);
  } else if (replaced_ && is_published(*store_, *replaced_) &&
             std::ranges::none_of(reports_, [&](const IngestReport& report) {
               return report.source.id == *replaced_;
             })) {
    // All is there already: a replacement that was interrupted after its commit may be run again.
    store_->remove(*replaced_, *context_);
  }
  for (const IngestReport& report : reports_) {
    if (!report.sensor_origin_changed) continue;
    store_->set_sensor_origin(report.source.id, *report.source.sensor_origin);
  }
  return std::exchange(reports_, {});
}

IngestReport ingest_points(PointReader& reader, const std::string& path, const Lattice& lattice,
                           PointStore& store, const IngestOptions& options,
                           const RunContext& context) {
  SurveyIngest survey(lattice, store, context);
  survey.stage(reader, path, options);
  return survey.publish().front();
}

}  // namespace gdfmap
