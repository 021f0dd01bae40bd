#include "blockid/data/mat_integrity.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "blockid/data/error.hpp"

namespace blockid::mat {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMat5Header = 128;
constexpr std::uint64_t kMat5Tag = 8;
constexpr std::uint32_t kMatrix = 14;
constexpr std::uint32_t kCompressed = 15;

/// A variable's place in the file.
struct Element {
  std::uint64_t offset = 0;  ///< of its header
  std::uint64_t data = 0;    ///< of what follows the header
  std::uint64_t end = 0;
  bool compressed = false;
};

class Reader {
 public:
  explicit Reader(const fs::path& path) : source_(path.string()), stream_(path, std::ios::binary) {
    std::error_code code;
    size_ = fs::file_size(path, code);
    if (code || !stream_) fail(source_, ": cannot read: cannot be opened");
  }

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::string& source() const { return source_; }
  void set_big_endian(bool big) { big_endian_ = big; }

  /// Up to count bytes; fewer at the end of the file.
  [[nodiscard]] std::string bytes(std::uint64_t offset, std::size_t count) {
    std::string block(count, '\0');
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(offset));
    stream_.read(block.data(), static_cast<std::streamsize>(count));
    block.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream_.gcount(), 0)));
    return block;
  }

  /// count unsigned numbers of four bytes, or nothing when the file ends before.
  [[nodiscard]] std::optional<std::vector<std::uint32_t>> words(std::uint64_t offset, std::size_t count) {
    const std::string block = bytes(offset, 4 * count);
    if (block.size() != 4 * count) return std::nullopt;
    std::vector<std::uint32_t> result(count, 0);
    for (std::size_t i = 0; i < block.size(); ++i) {
      const std::size_t shift = 8 * (big_endian_ ? 3 - i % 4 : i % 4);
      result[i / 4] |= static_cast<std::uint32_t>(static_cast<unsigned char>(block[i])) << shift;
    }
    return result;
  }

 private:
  std::string source_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
  bool big_endian_ = false;
};

[[noreturn]] void fail_truncated(const Reader& reader, const Element& element) {
  fail(reader.source(), ": truncated: the variable at byte ", element.offset, " should end at byte ", element.end,
       ", the file has ", reader.size(), " bytes");
}

/// Sets the byte order when it is a v5 file.
bool is_mat5(Reader& reader) {
  const std::string header = reader.bytes(0, kMat5Header);
  if (header.size() < kMat5Header) return false;
  const std::string_view mark = std::string_view(header).substr(kMat5Header - 4);
  const bool little = mark == std::string_view("\x00\x01IM", 4);
  const bool big = mark == std::string_view("\x01\x00MI", 4);
  reader.set_big_endian(big);
  return little || big;
}

std::optional<Element> next_mat5(Reader& reader, std::uint64_t offset) {
  if (offset >= reader.size()) return std::nullopt;
  const auto tag = reader.words(offset, 2);
  if (!tag) fail_truncated(reader, {offset, offset, offset + kMat5Tag, false});
  if ((*tag)[0] != kMatrix && (*tag)[0] != kCompressed) return std::nullopt;
  const std::uint64_t data = offset + kMat5Tag;
  return Element{offset, data, data + (*tag)[1], (*tag)[0] == kCompressed};
}

/// The header's first word is M 1000 + P 10 + T: byte order, precision, full/text/sparse.
std::optional<Element> next_mat4(Reader& reader, std::uint64_t offset) {
  constexpr std::uint64_t kHeader = 20;
  constexpr std::array<std::uint64_t, 6> kSizes = {8, 4, 4, 2, 2, 1};
  if (offset >= reader.size()) return std::nullopt;
  const auto header = reader.words(offset, 5);
  if (!header) fail_truncated(reader, {offset, offset, offset + kHeader, false});
  const std::uint32_t precision = (*header)[0] / 10 % 10;
  if (precision >= kSizes.size()) return std::nullopt;
  const std::uint64_t parts = (*header)[3] != 0 ? 2 : 1;
  const std::uint64_t elements = std::uint64_t{(*header)[1]} * (*header)[2];
  if (elements > std::numeric_limits<std::uint64_t>::max() / 32) return std::nullopt;
  const std::uint64_t data = offset + kHeader + (*header)[4];
  return Element{offset, data, data + elements * kSizes[precision] * parts, false};
}

bool is_mat4(Reader& reader) {
  constexpr std::uint32_t kLargestType = 4052;
  for (const bool big : {false, true}) {
    reader.set_big_endian(big);
    const auto type = reader.words(0, 1);
    if (type && (*type)[0] <= kLargestType) return true;
  }
  return false;
}

class Inflater {
 public:
  Inflater() {
    if (inflateInit(&stream_) != Z_OK) fail("zlib: out of memory");
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() { inflateEnd(&stream_); }

  /// Feeds a block and returns zlib's last answer: Z_STREAM_END once the checksum is found right.
  int feed(std::string& block) {
    stream_.next_in = reinterpret_cast<Bytef*>(block.data());
    stream_.avail_in = static_cast<uInt>(block.size());
    int answer = Z_OK;
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(scratch_.data());
      stream_.avail_out = static_cast<uInt>(scratch_.size());
      answer = inflate(&stream_, Z_NO_FLUSH);
    } while (answer == Z_OK && (stream_.avail_in > 0 || stream_.avail_out == 0));
    return answer;
  }

 private:
  z_stream stream_{};
  std::string scratch_ = std::string(std::size_t{1} << 16U, '\0');
};

bool inflates(Reader& reader, const Element& element) {
  constexpr std::uint64_t kBlock = std::uint64_t{1} << 16U;
  Inflater inflater;
  int answer = Z_OK;
  for (std::uint64_t at = element.data; at < element.end && (answer == Z_OK || answer == Z_BUF_ERROR); at += kBlock) {
    std::string block = reader.bytes(at, static_cast<std::size_t>(std::min(kBlock, element.end - at)));
    answer = inflater.feed(block);
  }
  return answer == Z_STREAM_END;
}

}  // namespace

void check_not_truncated(const fs::path& path) {
  Reader reader(path);
  const bool mat5 = is_mat5(reader);
  if (!mat5 && !is_mat4(reader)) return;
  std::optional<Element> element = mat5 ? next_mat5(reader, kMat5Header) : next_mat4(reader, 0);
  while (element) {
    if (element->end > reader.size()) fail_truncated(reader, *element);
    element = mat5 ? next_mat5(reader, element->end) : next_mat4(reader, element->end);
  }
}

void check_compressed_data(const fs::path& path) {
  Reader reader(path);
  if (!is_mat5(reader)) return;
  for (auto element = next_mat5(reader, kMat5Header); element; element = next_mat5(reader, element->end)) {
    if (element->compressed && !inflates(reader, *element)) {
      fail(reader.source(), ": damaged: the compressed variable at byte ", element->offset,
           " does not match its checksum");
    }
  }
}

}  // namespace blockid::mat
