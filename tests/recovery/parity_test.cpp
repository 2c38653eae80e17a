// Tests of parity. Lost parts of a file are restored if the parity suffices, and foreign data after
// the trailer has no effect.
#include "archive/parity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>

#include "base/binary.h"
#include "base/failure.h"
#include "shm/segment_reader.h"
#include "support/feature_files.h"
#include "support/file_fields.h"
#include "support/item_text.h"
#include "support/parity_file.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

using Bytes = std::vector<std::byte>;

Bytes random_bytes(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Bytes bytes(count);
  for (std::byte& it : bytes) it = static_cast<std::byte>(random());
  return bytes;
}

Bytes with_parity(const Bytes& bytes, const ParityShape& shape) {
  MemoryRandomSource source(bytes);
  MemorySink sink;
  const std::uint64_t written = write_parity(source, shape, sink);
  EXPECT_EQ(written, sink.bytes.size());
  Bytes all = bytes;
  all.insert(all.end(), sink.bytes.begin(), sink.bytes.end());
  return all;
}
Bytes with_parity(const Bytes& bytes, double share) {
  return with_parity(bytes, parity_shape(bytes.size(), share));
}

void lose(Bytes& file, std::uint64_t sector) {
  const std::size_t begin = static_cast<std::size_t>(sector) * 4096;
  std::fill(file.begin() + static_cast<std::ptrdiff_t>(begin),
            file.begin() + static_cast<std::ptrdiff_t>(std::min(begin + 4096, file.size())),
            std::byte{0});
}

struct Outcome {
  bool found = false;
  std::vector<std::uint64_t> damaged, lost;
  std::uint64_t damaged_packets = 0;
  Bytes healed;
};
Outcome heal(const Bytes& file) {
  TemporaryFolder folder;
  MemoryRandomSource source(file);
  const auto it = ProtectedFile::open(source);
  if (!it) return {};
  it->check();
  const auto scratch = unwrap(FileSink::create_scratch(folder / ".", "heal"), "");
  Outcome out;
  out.found = true;
  out.damaged = it->damaged_blocks();
  out.damaged_packets = it->damaged_packets();
  out.lost = it->heal(*scratch);
  out.healed.resize(it->healed().size());
  unwrap(it->healed().read_at(0, out.healed), "");
  return out;
}

class Parity : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_parity_codes()) GTEST_SKIP() << "built without ISA-L";
  }
};

TEST(ParityShapes, AreAsLargeAsTheirShare) {
  for (const double share : {.001, .01, .05, .3, 1.0})
    for (const std::uint64_t bytes :
         {std::uint64_t{16}, std::uint64_t{4096}, std::uint64_t{4097}, std::uint64_t{1} << 20,
          std::uint64_t{254} * 4096, std::uint64_t{255} * 4096, std::uint64_t{123456789},
          std::uint64_t{1} << 40}) {
      const ParityShape shape = parity_shape(bytes, share);
      EXPECT_EQ(shape.protected_bytes, bytes);
      EXPECT_GE(shape.data, 1u);
      EXPECT_LE(shape.data + shape.parity, 255u);
      EXPECT_GE(shape.parity, share * shape.data - 1e-6);
      EXPECT_LT(shape.parity, share * shape.data + 1);
      EXPECT_GE(shape.stripes() * shape.data, shape.blocks());
      EXPECT_LT((shape.stripes() - 1) * shape.data, shape.blocks());
    }
}

TEST_F(Parity, NothingLostIsNothingDone) {
  for (const std::size_t bytes : {16u, 4095u, 4096u, 4097u, 100'000u, 5'000'000u}) {
    const Bytes file = random_bytes(bytes, bytes);
    const Outcome outcome = heal(with_parity(file, .05));
    ASSERT_TRUE(outcome.found) << bytes;
    EXPECT_TRUE(outcome.damaged.empty());
    EXPECT_EQ(outcome.damaged_packets, 0u);
    EXPECT_EQ(outcome.healed, file);
  }
}

// If a stripe has N parity blocks, it can be restored after the loss of any N of its blocks.
TEST_F(Parity, AsManyBlocksOfAStripeAsItHasParity) {
  const Bytes file = random_bytes(300 * 4096 - 77, 1);
  const ParityShape shape = parity_shape(file.size(), .05);
  ASSERT_EQ(shape.stripes(), 2u);
  const Bytes whole = with_parity(file, shape);
  std::mt19937_64 random(2);
  for (int round = 0; round < 20; ++round) {
    Bytes damaged = whole;
    std::vector<std::uint64_t> lost;
    for (std::uint64_t stripe = 0; stripe < 2; ++stripe) {
      std::vector<std::uint64_t> of_stripe;
      for (std::uint64_t b = stripe; b < shape.blocks(); b += 2) of_stripe.push_back(b);
      std::shuffle(of_stripe.begin(), of_stripe.end(), random);
      of_stripe.resize(shape.parity);
      lost.insert(lost.end(), of_stripe.begin(), of_stripe.end());
    }
    std::sort(lost.begin(), lost.end());
    for (std::uint64_t block : lost) lose(damaged, block);
    std::copy(whole.begin() + static_cast<std::ptrdiff_t>(file.size()), whole.end(),
              damaged.begin() + static_cast<std::ptrdiff_t>(file.size()));
    const Outcome outcome = heal(damaged);
    EXPECT_EQ(outcome.damaged, lost);
    EXPECT_TRUE(outcome.lost.empty());
    ASSERT_EQ(outcome.healed, file);

    // Both stripes have already lost the largest number of blocks that the parity can restore. If
    // one stripe loses another block, it cannot be restored; the other stripe still can.
    std::uint64_t more = 0;
    while (std::binary_search(lost.begin(), lost.end(), more)) more += 2;
    lose(damaged, more);
    const Outcome beyond = heal(damaged);
    EXPECT_EQ(beyond.lost.size(), shape.parity + 1u);
    for (std::uint64_t block : beyond.lost) EXPECT_EQ(block % 2, 0u);
  }
}

// Damages a contiguous range or single sectors, at any position in the file or in its parity
// packets.
TEST_F(Parity, APieceAnywhereAsLongAsTheShare) {
  const Bytes file = random_bytes(2'000'000, 3);
  const ParityShape shape = parity_shape(file.size(), .05);
  const Bytes whole = with_parity(file, shape);
  const std::uint64_t sectors = (whole.size() - 1) / 4096 + 1;
  const std::uint64_t length = shape.parity * shape.stripes() - 1;
  for (std::uint64_t first = 0; first + length < sectors; first += 7) {
    Bytes damaged = whole;
    // The range is too short to damage both copies of the checksums.
    for (std::uint64_t s = first; s < first + length; ++s) lose(damaged, s);
    const Outcome outcome = heal(damaged);
    if (first * 4096 >= file.size()) {
      EXPECT_TRUE(outcome.damaged.empty()) << first;
      continue;
    }
    if ((first + length) * 4096 > file.size()) continue;  // covers blocks and packets
    ASSERT_TRUE(outcome.lost.empty()) << first;
    ASSERT_EQ(outcome.healed, file) << first;
  }
}

TEST_F(Parity, OneSectorInAHundred) {
  const Bytes file = random_bytes(8'000'000, 4);
  const Bytes whole = with_parity(file, .06);
  const std::uint64_t sectors = (whole.size() - 1) / 4096 + 1;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    std::mt19937_64 random(seed);
    Bytes damaged = whole;
    for (std::uint64_t i = 0; i < sectors / 100; ++i) lose(damaged, random() % sectors);
    const Outcome outcome = heal(damaged);
    ASSERT_TRUE(outcome.found);
    ASSERT_TRUE(outcome.lost.empty()) << seed;
    ASSERT_EQ(outcome.healed, file) << seed;
  }
}

// Some checksums are lost in both copies. Blocks without a checksum are treated as damaged: they
// are restored if the parity suffices, and otherwise counted as lost.
TEST_F(Parity, ChecksumsThatAreLostTwice) {
  const Bytes file = random_bytes(40 * 4096, 5);
  const ParityShape shape = parity_shape(file.size(), 1);
  ASSERT_EQ(shape.parity, 40u);
  Bytes damaged = with_parity(file, shape);
  const std::size_t packet = 4136;
  const std::size_t again = file.size() + packet * 41;
  damaged[file.size() + 50] ^= std::byte{1};
  damaged[again + 50] ^= std::byte{1};
  lose(damaged, 3);
  Outcome outcome = heal(damaged);
  EXPECT_EQ(outcome.damaged.size(), 40u);
  EXPECT_EQ(outcome.damaged_packets, 2u);
  EXPECT_TRUE(outcome.lost.empty());
  EXPECT_EQ(outcome.healed, file);

  damaged[file.size() + packet + 100] ^= std::byte{1};  // leaves 39 rows for 40 blocks
  outcome = heal(damaged);
  EXPECT_EQ(outcome.lost.size(), 40u);
}

// If a byte of a packet is damaged, only that packet becomes unusable.
TEST_F(Parity, FlippedBytesOfPackets) {
  const Bytes file = random_bytes(10'000, 6);
  const Bytes whole = with_parity(file, .4);
  const std::size_t packets = (whole.size() - 16 - file.size()) / 4136;
  for (std::size_t p = 0; p < packets; ++p)
    for (std::size_t at : {0, 3, 4, 5, 6, 7, 8, 15, 16, 19, 20, 27, 28, 32, 36, 39, 40, 4135}) {
      Bytes damaged = whole;
      damaged[file.size() + p * 4136 + at] ^= std::byte{0x10};
      const Outcome outcome = heal(damaged);
      ASSERT_TRUE(outcome.found);
      EXPECT_EQ(outcome.damaged_packets, 1u) << p << " at " << at;
      EXPECT_EQ(outcome.healed, file);
    }
}

// A packet is ignored if it claims to protect more bytes than the file has, or if it is at a wrong
// offset.
TEST_F(Parity, PacketsInTheWrongPlaceAreNone) {
  const Bytes file = random_bytes(10'000, 7);
  Bytes whole = with_parity(file, .4);
  Bytes moved = whole;
  moved.insert(moved.begin(), std::byte{0});
  EXPECT_FALSE(heal(moved).found);
  // Inside another protected file.
  const Bytes outer = with_parity(whole, .4);
  const Outcome outcome = heal(outer);
  EXPECT_EQ(outcome.healed, whole);
  for (std::size_t cut = 0; cut < whole.size(); cut += 997) {
    const Bytes front(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut));
    const Outcome of_front = heal(front);
    if (of_front.found) {
      EXPECT_EQ(of_front.healed, file);
    }
  }
}

// A packet header is ignored if it claims more parity than data or more bytes than the file has. No
// memory is allocated for such a packet.
TEST_F(Parity, LyingHeadersAreNone) {
  const Bytes file = random_bytes(10'000, 8);
  const Bytes whole = with_parity(file, ParityShape{file.size(), 2, 2});
  ASSERT_TRUE(heal(whole).found);
  const auto lied = [&](std::size_t at, std::uint64_t value, std::size_t bytes) {
    Bytes damaged = whole;
    for (std::size_t p = file.size(); p + 4136 <= damaged.size(); p += 4136) {
      for (std::size_t i = 0; i < bytes; ++i)
        damaged[p + at + i] = static_cast<std::byte>(value >> 8 * i);
      const std::uint32_t sum = checksum(std::span(damaged).subspan(p, 36));
      for (std::size_t i = 0; i < 4; ++i)
        damaged[p + 36 + i] = static_cast<std::byte>(sum >> 8 * i);
    }
    return heal(damaged).found;
  };
  EXPECT_TRUE(lied(6, 2, 1)) << "the unchanged value";
  EXPECT_FALSE(lied(6, 1, 1));
  EXPECT_FALSE(lied(6, 0, 1));
  EXPECT_FALSE(lied(7, 3, 1));
  EXPECT_FALSE(lied(7, 0, 1));
  for (const std::uint64_t bytes : {std::uint64_t{0}, std::uint64_t{15}, std::uint64_t{20'000'000},
                                    std::uint64_t{576460752303423695}, ~std::uint64_t{0}})
    EXPECT_FALSE(lied(8, bytes, 8)) << bytes;
}

/// A source in which some sectors cannot be read.
class WornSource final : public RandomSource {
 public:
  WornSource(std::span<const std::byte> bytes, std::vector<std::uint64_t> worn)
      : bytes_(bytes), worn_(std::move(worn)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    for (std::uint64_t sector : worn_)
      if (sector * 4096 < offset + into.size() && (sector + 1) * 4096 > offset)
        return Error{ErrorCode::io, "cannot be read", {}, kNoOffset, {}};
    return bytes_.read_at(offset, into);
  }

 private:
  MemoryRandomSource bytes_;
  std::vector<std::uint64_t> worn_;
};

TEST_F(Parity, SectorsThatCannotBeRead) {
  const Bytes file = random_bytes(200 * 4096 + 5, 9);
  const Bytes whole = with_parity(file, .1);
  WornSource source(whole, {0, 7, 8, 100, 199, 200, 210});
  const auto it = ProtectedFile::open(source);
  ASSERT_TRUE(it);
  it->check();
  EXPECT_EQ(it->damaged_blocks(), (std::vector<std::uint64_t>{0, 7, 8, 100, 199, 200}));
  TemporaryFolder folder;
  const auto scratch = unwrap(FileSink::create_scratch(folder / ".", "heal"), "");
  EXPECT_TRUE(it->heal(*scratch).empty());
  Bytes healed(file.size());
  unwrap(it->healed().read_at(0, healed), "");
  EXPECT_EQ(healed, file);
}

// Readers ignore the parity, whether they read front to back or using the index.
TEST_F(Parity, ReadersDoNotMind) {
  for (const FeatureFile& feature : feature_files()) {
    const Bytes whole = with_parity(feature.bytes, .2);
    MemoryRandomSource plain(feature.bytes), source(whole);
    EXPECT_TRUE(is_whole_file(plain)) << feature.name;
    EXPECT_FALSE(is_whole_file(source)) << feature.name;
    EXPECT_FALSE(ProtectedFile::open(plain));
    const auto expected = SegmentReader::open(plain), reader = SegmentReader::open(source);
    ASSERT_TRUE(expected) << expected.error().message();
    ASSERT_TRUE(reader) << feature.name << ": " << reader.error().message();
    EXPECT_EQ(reader->segments().size(), expected->segments().size());
    ASSERT_TRUE(text_of_file(whole)) << feature.name;
  }
}

// Every version of the library must be able to repair files of all earlier versions.
TEST_F(Parity, GoldenFilesHeal) {
  for (const char* version : {"0.1", "0.9", "0.10"}) {
    SCOPED_TRACE(version);
    std::ifstream in(SHM_SOURCE_DIR "/tests/golden/" + std::string(version) + "/parity.shm",
                     std::ios::binary);
    const std::string text(std::istreambuf_iterator<char>(in), {});
    Bytes file(text.size());
    std::transform(text.begin(), text.end(), file.begin(), [](char c) { return std::byte(c); });
    if (std::string(version) == "0.10") {
      ASSERT_EQ(file, parity_file().bytes);
    }
    const Bytes whole = heal(file).healed;
    lose(file, 0);
    const Outcome outcome = heal(file);
    EXPECT_EQ(outcome.damaged, std::vector<std::uint64_t>{0});
    EXPECT_EQ(outcome.healed, whole);
  }
}

// The specification determines every byte of the parity, so the bytes must be the same on every
// machine.
TEST_F(Parity, IsTheSameEverywhere) {
  Bytes file(3 * 4096 + 100);
  for (std::size_t i = 0; i < file.size(); ++i) file[i] = static_cast<std::byte>(i * i >> 5);
  const Bytes whole = with_parity(file, ParityShape{file.size(), 4, 2});
  ASSERT_EQ(whole.size(), file.size() + 4 * 4136 + 16);
  std::uint64_t sum = 0;
  for (std::byte it : whole) sum = sum * 0x100000001b3u + std::to_integer<std::uint64_t>(it);
  EXPECT_EQ(sum, 9290023745792755765u) << "the bytes have changed";
}

// Replaces each field of a packet with wrong values, in one packet or in all packets, and corrects
// the checksums.
TEST_F(Parity, FieldsThatLie) {
  const Bytes whole = parity_file().bytes;
  const auto places = parity_packets(whole);
  ASSERT_GE(places.size(), 3u);
  for (std::size_t p = 0; p <= places.size(); ++p) {
    const Section first = parity_header(whole, places[p % places.size()]);
    EXPECT_EQ(first.fields.back().end, kPacketHeader);
    for (std::size_t f = 0; f < first.fields.size(); ++f)
      for (std::uint64_t way = p; way < 64; way += every(5)) {
        Bytes inconsistent = whole;
        for (std::size_t i = 0; i < places.size(); ++i) {
          if (p < places.size() && p != i) continue;
          const Section header = parity_header(whole, places[i]);
          put_parity_header(inconsistent, places[i], changed(header, header.fields[f], way));
          const auto put = std::span(inconsistent).subspan(places[i]);
          EXPECT_EQ(ByteReader(put.subspan(36)).get_u32(), checksum(put.first(36)));
        }
        try {
          (void)heal(inconsistent);
        } catch (const Failure&) {
        }
      }
  }
}

}  // namespace
}  // namespace shm::converters
