// Sources and sinks of bytes: small interfaces and their usual implementations. The library passes
// file names to the operating system unchanged. On Windows, file names are UTF-8.
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

/// Destination of a sequence of bytes. Derive a class from ByteSink to write to a destination of
/// your own. The library writes all bytes in order and never seeks.
class SHM_API ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Writes all of `bytes` or returns an error. After an error the library does not use the sink
  /// again.
  virtual Result<void> write(std::span<const std::byte> bytes) = 0;
  /// Copies `bytes` bytes of `from`, starting at `offset`, to this sink. A sink may override this
  /// function so that the operating system copies the bytes directly.
  virtual Result<void> copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes);
  /// Declares the output complete. Writer::finish() and all other calls that finish a file call
  /// commit() once, after the last byte. Most sinks do nothing here. A sink that forwards its bytes
  /// to another sink also calls commit() of that sink, unless more bytes will be written to that
  /// sink (as after a member of an archive).
  virtual Result<void> commit();
  /// Stores all bytes written so far so that a crash does not lose them. Writer::commit() and
  /// Writer::finish() call it before they write the trailer, the last 16 bytes. Most sinks do
  /// nothing here.
  virtual Result<void> flush();
  /// Makes all bytes written so far visible to readers, as a whole file. More bytes may follow.
  /// Writer::commit() calls it after it has written the trailer. Most sinks do nothing here.
  virtual Result<void> publish();
};

/// Sequence of bytes that is read from front to back.
class SHM_API ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Reads between 1 and into.size() bytes into the front of `into`, and returns their number.
  /// Returns 0 only at the end of the source.
  virtual Result<std::size_t> read(std::span<std::byte> into) = 0;
};

/// Sink that appends all bytes to its member `bytes`.
class SHM_API MemorySink final : public ByteSink {
 public:
  Result<void> write(std::span<const std::byte> bytes) override;
  std::vector<std::byte> bytes;
};

/// Source that reads borrowed memory. The memory must outlive the source.
class SHM_API MemorySource final : public ByteSource {
 public:
  explicit MemorySource(std::span<const std::byte> bytes) : left_(bytes) {}
  Result<std::size_t> read(std::span<std::byte> into) override;
  /// Bytes that have not been read yet.
  std::span<const std::byte> left() const { return left_; }

 private:
  std::span<const std::byte> left_;
};

/// Sink that counts the bytes and discards them.
class SHM_API NullSink final : public ByteSink {
 public:
  Result<void> write(std::span<const std::byte> bytes) override;
  std::uint64_t bytes = 0;
};

/// Sink that writes a file. The file appears under its name only when it is complete. Until then,
/// the bytes are written to an unnamed file in the same folder. If the process ends before
/// commit(), the operating system removes this file. commit() flushes this file to the disk and
/// makes it visible under the final name. An existing file of that name is replaced by renaming.
/// Writer, PartJoiner, Appender and ArchiveWriter call commit() in finish(). write_mesh() and
/// write_in_order() call commit() at their end. Callers that write bytes themselves must call
/// commit() too: a FileSink that is destroyed without commit() leaves no file.
///
/// If the operating system does not support unnamed files, or if the caller requests a named
/// temporary file, the name of the temporary file is ".NAME.tmp" plus numbers that identify the
/// process and the machine. The temporary file is removed when the FileSink is destroyed without
/// commit(). If a process was killed, its temporary file remains. The next time a named temporary
/// file is created for the same path, create() removes it (a file from another machine only after
/// an hour).
///
/// The new file gets the permissions and, if the user may set it, the group of the file that it
/// replaces (not on Windows). If the path is a symbolic link, its target is replaced. On Windows a
/// file that is open elsewhere can be replaced only if its file system supports that. The path "-"
/// means standard output; commit() then does nothing.
class SHM_API FileSink final : public ByteSink {
 public:
  enum class Temporary : std::uint8_t { unnamed, named };
  enum class Existing : std::uint8_t { replace, refuse };
  /// Creates the temporary file for `path`. If `how` is `named`, the temporary file has a name. If
  /// `existing` is `refuse`, an existing file is never changed: create() and commit() fail with
  /// ErrorCode::output if the path exists when they are called.
  static Result<std::unique_ptr<FileSink>> create(const std::string& path,
                                                  Temporary how = Temporary::unnamed,
                                                  Existing existing = Existing::replace);
  /// Creates a scratch file in `folder`; if `folder` is empty, in /var/tmp (on Windows, in the
  /// folder for temporary files). Only the current user may access this file, and the file never
  /// appears under a final name. If the operating system does not support unnamed files, or if
  /// `how` is `named`, the file has a temporary name that contains `name`, so that users can
  /// recognize the file. commit() does nothing.
  static Result<std::unique_ptr<FileSink>> create_scratch(const std::string& folder,
                                                          const std::string& name,
                                                          Temporary how = Temporary::unnamed);
  /// Creates the temporary file for a live file, which readers may open while it is written. The
  /// first publish() makes the file visible under its final name; an existing file stays until
  /// then. Later calls of publish() make the bytes written since then visible. If the process ends,
  /// the file keeps what has been published; a reader ignores bytes after it. If a call fails, or
  /// if the FileSink is destroyed before commit(), the file is cut back to what has been published.
  /// After the first publish(), every other FileSink for `path` fails until this one is closed.
  static Result<std::unique_ptr<FileSink>> create_live(const std::string& path,
                                                       Existing existing = Existing::replace);
  /// Opens an existing file to continue it in place, as a live file. Call continue_at() before the
  /// first write. Fails with ErrorCode::output if the path is a symbolic link, or if the file has
  /// more than one name, because another name would show the changes, too.
  static Result<std::unique_ptr<FileSink>> open_live(const std::string& path);
  /// Continues a file from open_live() after its first `bytes` bytes, and discards the others.
  Result<void> continue_at(std::uint64_t bytes);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;
  Result<void> write(std::span<const std::byte> bytes) override;
  /// Writes all bytes at `offset` of a scratch file. Bytes before them that were never written are
  /// zeros.
  Result<void> write_at(std::uint64_t offset, std::span<const std::byte> bytes);
  Result<void> copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) override;
  /// Completes the file. After commit() has succeeded, further calls do nothing, and nothing more
  /// can be written. If commit() fails, the file does not appear under its final name, with one
  /// exception: if only the final step fails, which flushes the folder to the disk, the file
  /// exists, and the error message says so.
  Result<void> commit() override;
  /// Flushes the bytes of a live file to the disk. Does nothing for other files.
  Result<void> flush() override;
  /// Makes a live file visible: see create_live(). Fails with ErrorCode::misuse for other files;
  /// does nothing for standard output, devices and pipes.
  Result<void> publish() override;

  /// Returns a path under which this process can open the file before commit(), e.g. to write to it
  /// without this sink. For an unnamed file, the path is in /proc. The path is empty if the sink
  /// has no temporary file.
  const std::string& temporary() const { return temporary_; }
  bool is_named() const { return named_; }

 private:
  FileSink() = default;
  Result<void> create_temporary(Temporary how);
  Result<void> create_named();
  void pass_permissions_on() const;
  Result<void> flush_file() const;
  Result<void> make_visible();
  void cut_back();
  Result<void> close();
  Result<void> link();
  Result<void> rename_temporary() const;
  Result<void> rename_copy(const Error& why);
  /// Permissions of the file that is replaced.
  struct Permissions {
    std::uint32_t mode = 0, group = 0;
  };
  int descriptor_ = -1;
  bool named_ = false;    // true if a temporary file has to be removed
  bool scratch_ = false;  // true for a scratch file, which never gets a final name
  bool committed_ = false;
  bool replaces_ = true;    // true: commit() replaces an existing file
  bool live_ = false;       // true for a live file
  bool published_ = false;  // true if publish() has made the file visible
  // Number of bytes written to the file, and number of them when it was last published.
  std::uint64_t bytes_ = 0, published_bytes_ = 0;
  std::optional<Permissions> permissions_;
  std::string path_, temporary_;
};

/// Source that reads a file; the path "-" means standard input.
class SHM_API FileSource final : public ByteSource {
 public:
  static Result<std::unique_ptr<FileSource>> open(const std::string& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  Result<std::size_t> read(std::span<std::byte> into) override;
  /// Opens the whole file again for random access, independently of this source. Fails if the file
  /// is not seekable, e.g. a pipe.
  Result<std::unique_ptr<FileRandomSource>> anywhere() const;

 private:
  FileSource() = default;
  int descriptor_ = -1;
  std::string path_;
};

/// A range of bytes of a source.
struct ByteRange {
  std::uint64_t offset = 0, bytes = 0;
};

/// Source of bytes that can be read from any offset.
class SHM_API RandomSource {
 public:
  virtual ~RandomSource() = default;
  virtual std::uint64_t size() const = 0;
  /// Fills the whole of `into` with the bytes that begin at `offset`, or fails.
  virtual Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) = 0;
  /// Announces the ranges that the library will probably read next, mostly in this order, so that a
  /// remote source can fetch them together. Most sources do nothing. A range may lie outside the
  /// source, and may never be read.
  virtual void prefetch(std::span<const ByteRange> ranges);
};

/// Source with random access to borrowed memory. The memory must outlive the source.
class SHM_API MemoryRandomSource final : public RandomSource {
 public:
  explicit MemoryRandomSource(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override;

 private:
  std::span<const std::byte> bytes_;
};

/// Wraps another source so that several threads can use it. A mutex ensures that only one thread
/// reads at a time.
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

/// Source with random access to a seekable file.
class SHM_API FileRandomSource final : public RandomSource {
 public:
  static Result<std::unique_ptr<FileRandomSource>> open(const std::string& path);
  ~FileRandomSource() override;
  FileRandomSource(const FileRandomSource&) = delete;
  FileRandomSource& operator=(const FileRandomSource&) = delete;
  std::uint64_t size() const override { return size_; }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override;
  /// Copies `bytes` bytes, beginning at `offset`, to the current position of the open file
  /// `descriptor`. The bytes do not pass through this process. If the file system supports it, both
  /// files share the same blocks on disk. Returns the number of bytes copied: less than `bytes`, or
  /// 0, if the operating system cannot copy them.
  std::uint64_t copy_to(int descriptor, std::uint64_t offset, std::uint64_t bytes) const;

 private:
  friend class FileSource;
  FileRandomSource() = default;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  std::string path_;
};

/// Presents a range of bytes of another source as a source of its own, for sequential reading or
/// random access.
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
