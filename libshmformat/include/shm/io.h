// Where bytes come from and go to. Two interfaces of one call each, and the usual ends. Names of
// files are the system's bytes; on Windows they are UTF-8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "shm/result.h"

namespace shm {

class FileRandomSource;
class RandomSource;

/// Takes bytes, front to back. Implement it to write anywhere; the library never seeks.
class SHM_API ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// All of `bytes` or an error; after an error the sink is not used again.
  virtual Result<void> write(std::span<const std::byte> bytes) = 0;
  /// Writes `bytes` bytes of `from` from `offset` on. A sink that can leave that to the system
  /// does.
  virtual Result<void> copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes);
  /// What was written is complete, and nothing follows: called by whoever finishes a file
  /// (Writer::finish() and its like, once, after all bytes). Most sinks need not know that and do
  /// nothing; one that passes its bytes on to another sink passes this on, too, or keeps the end
  /// of the file to itself.
  virtual Result<void> commit();
};

/// Gives bytes, front to back.
class SHM_API ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Fills the front of `into`; returns how many bytes, 0 only at the end.
  virtual Result<std::size_t> read(std::span<std::byte> into) = 0;
};

/// Appends to memory.
class SHM_API MemorySink final : public ByteSink {
 public:
  Result<void> write(std::span<const std::byte> bytes) override;
  std::vector<std::byte> bytes;
};

/// Reads borrowed memory, which must outlive the source.
class SHM_API MemorySource final : public ByteSource {
 public:
  explicit MemorySource(std::span<const std::byte> bytes) : left_(bytes) {}
  Result<std::size_t> read(std::span<std::byte> into) override;
  /// What has not been read.
  std::span<const std::byte> left() const { return left_; }

 private:
  std::span<const std::byte> left_;
};

/// Counts and forgets.
class SHM_API NullSink final : public ByteSink {
 public:
  Result<void> write(std::span<const std::byte> bytes) override;
  std::uint64_t bytes = 0;
};

/// Writes a file that appears whole or not at all. Bytes go to a file without a name in the same
/// folder, which is gone with its process; commit() flushes it to the disk and gives it its name,
/// by renaming where there is a file of that name. Writer, PartJoiner, Appender and ArchiveWriter
/// call it in finish(), and write_mesh() and write_in_order() at their end; who writes bytes of
/// their own calls it, for a FileSink that is destroyed without commit() leaves no file. Where the
/// system has no files without names, or where it is asked for one, it is called ".NAME.tmp", with
/// numbers of process and machine, and removed when it is destroyed without commit(); what a killed
/// process has left, the next create() with a name for the same path removes (after an hour, where
/// that was on another machine). A file that is replaced passes its permissions and, where that is
/// allowed, its group on (Windows has neither); of a symbolic link the file that it leads to is
/// replaced. On Windows a file that somebody has open is replaced only where its file system can do
/// that. "-" is standard output (commit does nothing).
class SHM_API FileSink final : public ByteSink {
 public:
  enum class Temporary : std::uint8_t { unnamed, named };
  enum class Existing : std::uint8_t { replace, refuse };
  /// `how`: named, even where it need not be. `existing`: what happens where there is something of
  /// that name, now or when it is committed: refused, it stays as it is, and that is
  /// ErrorCode::output.
  static Result<std::unique_ptr<FileSink>> create(const std::string& path,
                                                  Temporary how = Temporary::unnamed,
                                                  Existing existing = Existing::replace);
  /// A file for a while, which never gets a name of its own: for this user alone, in `folder`.
  /// `name` tells, where it has a temporary name, whose it is. commit() does nothing.
  static Result<std::unique_ptr<FileSink>> create_scratch(const std::string& folder,
                                                          const std::string& name,
                                                          Temporary how = Temporary::unnamed);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;
  Result<void> write(std::span<const std::byte> bytes) override;
  Result<void> copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) override;
  /// Once it has succeeded it does nothing, and nothing more can be written. All that can fail is
  /// done before the file has its name, but for flushing the folder: that error says so.
  Result<void> commit() override;

  /// By what name this process may open the file until commit(), and write it instead of here; of
  /// a file without one it is a name in /proc. Empty where nothing is renamed in the end.
  const std::string& temporary() const { return temporary_; }
  bool is_named() const { return named_; }

 private:
  FileSink() = default;
  Result<void> create_temporary(Temporary how);
  Result<void> create_named();
  void pass_permissions_on() const;
  Result<void> flush() const;
  Result<void> close();
  Result<void> link();
  Result<void> rename_temporary() const;
  Result<void> rename_copy(const Error& why);
  /// Of a file that is replaced.
  struct Permissions {
    std::uint32_t mode = 0, group = 0;
  };
  int descriptor_ = -1;
  bool named_ = false;    // there is a temporary file to remove
  bool scratch_ = false;  // never gets a name
  bool committed_ = false;
  bool replaces_ = true;  // what has its name when it is committed
  std::optional<Permissions> permissions_;
  std::string path_, temporary_;
};

/// Reads a file; "-" is standard input.
class SHM_API FileSource final : public ByteSource {
 public:
  static Result<std::unique_ptr<FileSource>> open(const std::string& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  Result<std::size_t> read(std::span<std::byte> into) override;
  /// The same file, all of it, to be read anywhere, independently of this. An error where it cannot
  /// be sought in, as a pipe.
  Result<std::unique_ptr<FileRandomSource>> anywhere() const;

 private:
  FileSource() = default;
  int descriptor_ = -1;
  std::string path_;
};

/// Some bytes of a source.
struct ByteRange {
  std::uint64_t offset = 0, bytes = 0;
};

/// Gives bytes from anywhere.
class SHM_API RandomSource {
 public:
  virtual ~RandomSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Fills `into` with the bytes from `offset` on, or fails.
  virtual Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) = 0;
  /// What will be read next, mostly in this order: told before, so that a source whose bytes are
  /// far away can fetch them together. It need not; most do nothing. They need not be there, and
  /// may not be read in the end.
  virtual void prefetch(std::span<const ByteRange> ranges);
};

/// Reads borrowed memory, which must outlive the source.
class SHM_API MemoryRandomSource final : public RandomSource {
 public:
  explicit MemoryRandomSource(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override;

 private:
  std::span<const std::byte> bytes_;
};

/// Another source, for several threads: they are let to it one at a time.
class SHM_API SharedSource final : public RandomSource {
 public:
  explicit SharedSource(std::unique_ptr<RandomSource> source);
  ~SharedSource() override;
  SharedSource(const SharedSource&) = delete;
  SharedSource& operator=(const SharedSource&) = delete;
  std::uint64_t size() const override;
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override;
  void prefetch(std::span<const ByteRange> ranges) override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads a file that can be sought in.
class SHM_API FileRandomSource final : public RandomSource {
 public:
  static Result<std::unique_ptr<FileRandomSource>> open(const std::string& path);
  ~FileRandomSource() override;
  FileRandomSource(const FileRandomSource&) = delete;
  FileRandomSource& operator=(const FileRandomSource&) = delete;
  std::uint64_t size() const override { return size_; }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override;
  /// Copies bytes from `offset` on to where the open file `descriptor` stands, without taking them
  /// to this process: file systems that can share the blocks of both files do so. Returns how many
  /// of the `bytes` bytes that were; less, or none, where the system cannot.
  std::uint64_t copy_to(int descriptor, std::uint64_t offset, std::uint64_t bytes) const;

 private:
  friend class FileSource;
  FileRandomSource() = default;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  std::string path_;
};

/// Some consecutive bytes of another source as a source of their own, front to back or anywhere.
class SHM_API SectionSource final : public RandomSource, public ByteSource {
 public:
  /// `whole` is borrowed and must outlive the section. Reading beyond the end of `whole` fails.
  SectionSource(RandomSource& whole, std::uint64_t offset, std::uint64_t bytes)
      : whole_(&whole), offset_(offset), bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_; }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override;
  Result<std::size_t> read(std::span<std::byte> into) override;
  void prefetch(std::span<const ByteRange> ranges) override;

 private:
  RandomSource* whole_;
  std::uint64_t offset_, bytes_, at_ = 0;
};

}  // namespace shm
