// Reader: a Decoder that fetches its own bytes.
#include "shm/reader.h"

#include <optional>
#include <utility>

namespace shm {

namespace {
constexpr std::size_t kReadBytes = std::size_t{1} << 16;
}  // namespace

class __attribute__((visibility("hidden"))) Reader::Impl {
 public:
  Impl(ByteSource& source, const ReadLimits& limits, const ReadOptions& options)
      : source_(&source), decoder_(limits, options) {}

  /// Feeds until the schema is known.
  Result<void> open() {
    while (decoder_.schema() == nullptr) {
      auto progress = decoder_.advance();
      if (!progress) return progress.error();
      if (*progress == Decoder::Progress::need_input)
        if (auto good = fetch(); !good) return good;
    }
    return {};
  }
  Result<Item*> next() {
    item_.reset();
    while (true) {
      auto progress = decoder_.advance();
      if (!progress) return progress.error();
      switch (*progress) {
        case Decoder::Progress::finished: return static_cast<Item*>(nullptr);
        case Decoder::Progress::item_ready: item_ = decoder_.take(); return &*item_;
        case Decoder::Progress::need_input:
          if (auto good = fetch(); !good) return good.error();
      }
    }
  }
  const Decoder& decoder() const { return decoder_; }

 private:
  Result<void> fetch() {
    buffer_.resize(kReadBytes);
    auto count = source_->read(buffer_);
    if (!count) return count.error();
    if (*count == 0) decoder_.end_of_input();
    return decoder_.feed(std::span(buffer_).first(*count));
  }

  ByteSource* source_;
  Decoder decoder_;
  std::vector<std::byte> buffer_;
  std::optional<Item> item_;
};

Reader::Reader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Reader::Reader(Reader&&) noexcept = default;
Reader& Reader::operator=(Reader&&) noexcept = default;
Reader::~Reader() = default;

Result<Reader> Reader::open(ByteSource& source, const ReadLimits& limits,
                            const ReadOptions& options) {
  auto impl = std::make_unique<Impl>(source, limits, options);
  if (auto good = impl->open(); !good) return good.error();
  return Reader(std::move(impl));
}
const Schema& Reader::schema() const { return *impl_->decoder().schema(); }
Result<Item*> Reader::next() { return impl_->next(); }

}  // namespace shm
