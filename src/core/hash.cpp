#include <charconv>
#include <cstdio>
#include <new>

#include <xxhash.h>

#include <gdfmap/core/hash.hpp>

namespace gdfmap {
namespace {

Digest to_digest(const XXH128_hash_t& hash) { return {hash.low64, hash.high64}; }

}  // namespace

std::string Digest::hex() const {
  char text[33];
  std::snprintf(text, sizeof(text), "%016llx%016llx", static_cast<unsigned long long>(high),
                static_cast<unsigned long long>(low));
  return text;
}

std::optional<Digest> Digest::from_hex(std::string_view text) {
  if (text.size() != 32) return std::nullopt;
  Digest digest;
  const auto parse = [&](std::size_t offset, std::uint64_t& half) {
    const char* const begin = text.data() + offset;
    const auto [end, error] = std::from_chars(begin, begin + 16, half, 16);
    return error == std::errc{} && end == begin + 16;
  };
  if (!parse(0, digest.high) || !parse(16, digest.low)) return std::nullopt;
  return digest;
}

Digest hash128(std::span<const std::byte> bytes) {
  return to_digest(XXH3_128bits(bytes.data(), bytes.size()));
}

std::uint64_t hash64(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

struct StreamHasher::State {
  XXH3_state_t* xxh = XXH3_createState();
  State() {
    if (xxh == nullptr) throw std::bad_alloc();
    XXH3_128bits_reset(xxh);
  }
  ~State() { XXH3_freeState(xxh); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

StreamHasher::StreamHasher() : state_(std::make_unique<State>()) {}
StreamHasher::~StreamHasher() = default;
StreamHasher::StreamHasher(StreamHasher&&) noexcept = default;
StreamHasher& StreamHasher::operator=(StreamHasher&&) noexcept = default;

void StreamHasher::update(std::span<const std::byte> bytes) {
  XXH3_128bits_update(state_->xxh, bytes.data(), bytes.size());
}

Digest StreamHasher::digest() const { return to_digest(XXH3_128bits_digest(state_->xxh)); }

}  // namespace gdfmap
