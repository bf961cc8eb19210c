#include "length_code.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

namespace gdfmap {
namespace {

using Counts = std::array<std::uint32_t, kNumLengths>;

/// A code word as it stands in the stream, its first bit lowest.
struct Word {
  std::uint32_t word = 0;
  unsigned bits = 0;
};
using Words = std::array<Word, kNumLengths>;

unsigned lower_bits(int length) { return static_cast<unsigned>(std::max(length - 1, 0)); }

/// Bits of Huffman's code words.
CodeBits huffman_bits(const Counts& counts) {
  struct Node {
    std::uint32_t count;
    std::uint32_t members;  // one bit for each length below it
  };
  std::vector<Node> nodes;
  for (std::size_t length = 0; length < counts.size(); ++length) {
    if (counts[length] > 0) nodes.push_back({counts[length], 1u << length});
  }
  CodeBits bits{};
  if (nodes.size() == 1) bits[static_cast<std::size_t>(std::countr_zero(nodes[0].members))] = 1;
  while (nodes.size() > 1) {
    std::sort(nodes.begin(), nodes.end(), [](const Node& a, const Node& b) {
      return a.count != b.count ? a.count > b.count : a.members > b.members;
    });
    const Node last = nodes.back();
    nodes.pop_back();
    nodes.back().count += last.count;
    nodes.back().members |= last.members;
    for (std::size_t length = 0; length < bits.size(); ++length) {
      bits[length] += static_cast<std::uint8_t>(nodes.back().members >> length & 1);
    }
  }
  return bits;
}

/// Whether the words fill the space of codes exactly; one word alone takes no room.
bool is_prefix_code(const CodeBits& bits) {
  std::uint32_t used = 0, num_words = 0;
  for (const std::uint8_t n : bits) {
    if (n > kMaxCodeBits) return false;
    if (n == 0) continue;
    used += 1u << (kMaxCodeBits - n);
    ++num_words;
  }
  const std::uint32_t all = 1u << kMaxCodeBits;
  return num_words == 1 ? used == all / 2 : used == all;
}

std::uint32_t reversed(std::uint32_t word, unsigned bits) {
  std::uint32_t result = 0;
  for (unsigned i = 0; i < bits; ++i) result |= (word >> i & 1) << (bits - 1 - i);
  return result;
}

/// Shorter words first, then shorter lengths: the canonical code, which its bits alone determine.
Words words_of(const CodeBits& bits) {
  Words words;
  if (std::count(bits.begin(), bits.end(), 0) == kNumLengths - 1) return words;
  std::uint32_t next = 0;
  for (unsigned n = 1; n <= kMaxCodeBits; ++n, next <<= 1) {
    for (std::size_t length = 0; length < words.size(); ++length) {
      if (bits[length] == n) words[length] = {reversed(next++, n), n};
    }
  }
  return words;
}

}  // namespace

CodeBits code_bits_for(std::span<const std::uint16_t> numbers) {
  // Two counters for each length, so that equal ones in a row need not wait for one another.
  Counts counts{}, others{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    ++(i % 2 == 0 ? counts : others)[static_cast<std::size_t>(std::bit_width(numbers[i]))];
  }
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += others[i];
  CodeBits bits = huffman_bits(counts);
  // Rare lengths have the longest words; counts that differ less make them shorter.
  while (*std::max_element(bits.begin(), bits.end()) > kMaxCodeBits) {
    for (std::uint32_t& count : counts) count = (count + 1) / 2;
    bits = huffman_bits(counts);
  }
  return bits;
}

void put_stream(std::span<const std::uint16_t> numbers, const CodeBits& code_bits, Bytes& bytes) {
  const Words words = words_of(code_bits);
  const std::size_t begin = bytes.size();
  constexpr std::size_t kMaxBytesPerNumber = 3;  // a code word and 15 bits
  bytes.resize(begin + kMaxBytesPerNumber * numbers.size() + sizeof(std::uint64_t));
  // Locals, which a store to a byte cannot change, so that they stay in registers.
  std::byte* to = bytes.data() + begin;
  std::uint64_t waiting = 0;  // bits, the first one lowest
  unsigned num_waiting = 0;   // at most 7 between numbers
  for (const std::uint16_t number : numbers) {
    const int length = std::bit_width(number);
    const Word word = words[static_cast<std::size_t>(length)];
    const unsigned num_lower = lower_bits(length);
    const std::uint64_t lower = number & ((1u << num_lower) - 1);
    waiting |= (word.word | lower << word.bits) << num_waiting;
    num_waiting += word.bits + num_lower;
    store(to, waiting);
    to += num_waiting / 8;
    waiting >>= num_waiting & ~7u;
    num_waiting &= 7;
  }
  store(to, waiting);
  bytes.resize(static_cast<std::size_t>(to - bytes.data()) + (num_waiting > 0 ? 1 : 0));
}

std::optional<StreamReader> StreamReader::open(const std::byte* begin, std::size_t num_bytes,
                                               const CodeBits& code_bits) {
  if (!is_prefix_code(code_bits)) return std::nullopt;
  StreamReader reader;
  reader.begin_ = begin;
  reader.num_bytes_ = num_bytes;
  const Words words = words_of(code_bits);
  for (int length = 0; length < kNumLengths; ++length) {
    const auto l = static_cast<std::size_t>(length);
    if (code_bits[l] == 0) continue;
    const Entry entry{static_cast<std::uint8_t>(words[l].bits),
                      static_cast<std::uint8_t>(words[l].bits + lower_bits(length)),
                      static_cast<std::uint16_t>(length == 0 ? 0 : 1u << (length - 1)),
                      static_cast<std::uint16_t>((1u << lower_bits(length)) - 1)};
    const std::size_t step = std::size_t{1} << words[l].bits;
    for (std::size_t i = words[l].word; i < reader.table_.size(); i += step) {
      reader.table_[i] = entry;
    }
  }
  return reader;
}

bool StreamReader::is_at_end() const {
  if ((position_ + 7) / 8 != num_bytes_) return false;
  const auto used = static_cast<int>(position_ & 7);
  return used == 0 || std::to_integer<unsigned>(begin_[num_bytes_ - 1]) >> used == 0;
}

}  // namespace gdfmap
