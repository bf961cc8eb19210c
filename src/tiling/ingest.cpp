#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <gdfmap/core/error.hpp>
#include <gdfmap/tiling/ingest.hpp>

#include "block_pipeline.hpp"
#include "block_stager.hpp"
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

/// The shortest text that reads back as the same number; both zeros are "0".
std::string number_text(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value + 0.0).ptr;
  return {text.data(), end};
}

Digest source_identity(const Digest& file, const std::string& parameters) {
  ByteWriter writer;
  writer.put(file);
  writer.put_bytes(std::as_bytes(std::span(parameters)));
  return hash128(writer.bytes());
}

void check_options(const IngestOptions& options, const Lattice& lattice) {
  const double scale = options.transform.scale;
  if (!std::isfinite(scale) || scale <= 0.0) {
    throw Error(ErrorCode::kUsage, "scale must be a positive number, not " + number_text(scale));
  }
  if (!options.transform.T_map_source.matrix().allFinite()) {
    throw Error(ErrorCode::kUsage, "the transform has an entry that is not finite");
  }
  if (options.region && !(options.region->min().allFinite() && options.region->max().allFinite() &&
                          (options.region->sizes().array() > 0.0).all())) {
    throw Error(ErrorCode::kUsage, "the region must be finite and have its lower corner first");
  }
  if (options.voxel_size != 0.0 &&
      !(options.voxel_size >= lattice.step() && options.voxel_size <= lattice.cube_size())) {
    throw Error(ErrorCode::kUsage, "a voxel must be from " + number_text(lattice.step()) +
                                       " m to " + number_text(lattice.cube_size()) +
                                       " m long (a quantisation step to a cube of this map), not " +
                                       number_text(options.voxel_size) + " m");
  }
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

int voxel_steps(const IngestOptions& options, const Lattice& lattice) {
  return static_cast<int>(std::lround(options.voxel_size / lattice.step()));
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
    const Vector3 p_map = options_->transform.apply(p_source);
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

/// For a cloud that is there already. A replacement that was interrupted after its commit finds
/// nothing left to do.
void remove_replaced(PointStore& store, const IngestOptions& options, std::int64_t present,
                     const RunContext& context) {
  const auto replaced = options.replaced_source;
  if (replaced && *replaced != present && is_published(store, *replaced)) {
    store.remove(*replaced, context);
  }
}

void discard_quietly(PointStore& store, std::int64_t source, const RunContext& context) {
  try {
    store.discard(source, context);
  } catch (const std::exception&) {
    // The next writer deletes what is left; the first error, if any, is the one to tell.
  }
}

/// Stages the cloud as the source begun, and publishes it unless it is there already.
IngestReport stage_and_publish(PointReader& reader, const Lattice& lattice, PointStore& store,
                               const IngestOptions& options, const RunContext& context,
                               SourceRecord source) {
  IngestReport report;
  {
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
  source.identity = source_identity(reader.identity(), source.parameters);
  source.num_bytes = reader.num_bytes();
  if (auto known = store.find_source(source.identity)) {
    store.discard(source.id);
    remove_replaced(store, options, known->id, context);
    report.source = std::move(*known);
    report.already_present = true;
    return report;
  }
  store.publish(source, options.replaced_source);
  if (options.replaced_source) discard_quietly(store, *options.replaced_source, context);
  report.source = std::move(source);
  return report;
}

}  // namespace

std::string IngestOptions::canonical() const {
  std::string text = "scale=" + number_text(transform.scale) + " transform=";
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      text += number_text(transform.T_map_source(row, column));
      text += row == 2 && column == 3 ? ' ' : ',';
    }
  }
  text += std::string("drop_zero=") + (drop_zero ? "1" : "0");
  if (region) {
    text += " region=";
    for (const Vector3& corner : {region->min(), region->max()}) {
      for (int axis = 0; axis < 3; ++axis) {
        text += (text.back() == '=' ? "" : ",") + number_text(corner[axis]);
      }
    }
  }
  if (voxel_size != 0.0) text += " voxel=" + number_text(voxel_size);
  return text;
}

std::optional<SourceRecord> find_published(const std::string& path, const IngestOptions& options,
                                           PointStore& store, const RunContext& context) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  const std::uintmax_t num_bytes = std::filesystem::file_size(path, error);
  if (error || !store.has_source_of_size(num_bytes)) return std::nullopt;
  return store.find_source(
      source_identity(hash_file(path, num_bytes, context), options.canonical()));
}

IngestReport ingest_points(PointReader& reader, const std::string& path, const Lattice& lattice,
                           PointStore& store, const IngestOptions& options,
                           const RunContext& context) {
  check_options(options, lattice);
  SourceRecord source;
  source.path = path;
  source.parameters = options.canonical();
  source.voxel_steps = voxel_steps(options, lattice);
  if (auto known = find_published(path, options, store, context)) {
    remove_replaced(store, options, known->id, context);
    return {.source = std::move(*known), .already_present = true, .num_zero = 0};
  }
  check_replaced(options, store);
  check_disk(reader, path, store, options);
  source.id = store.begin_source(path, source.parameters, source.voxel_steps);
  try {
    IngestReport report = stage_and_publish(reader, lattice, store, options, context, source);
    warn_of_zeros(path, report, options, context);
    return report;
  } catch (...) {
    discard_quietly(store, source.id, {});
    throw;
  }
}

}  // namespace gdfmap
