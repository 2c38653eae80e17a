#include "mpi/output.h"

#include <mpi.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/failure.h"

namespace shm::converters {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 26;

void check(int code, const std::string& path) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING] = {};
  int length = 0;
  MPI_Error_string(code, text, &length);
  throw Failure(ErrorCode::output,
                "cannot be written: " + std::string(text, static_cast<std::size_t>(length)), path);
}

}  // namespace

struct SharedOutput::Handle {
  MPI_File file = MPI_FILE_NULL;
};

SharedOutput::SharedOutput(Ranks& ranks, std::string path)
    : ranks_(&ranks), path_(std::move(path)), handle_(std::make_unique<Handle>()) {
  ranks.together([&] {
    if (ranks.first()) file_.emplace(path_, "", FileSink::Temporary::named);
  });
  std::vector<std::byte> name;
  if (file_) {
    const auto bytes = std::as_bytes(std::span(file_->temporary()));
    name.assign(bytes.begin(), bytes.end());
  }
  name = ranks.broadcast(std::move(name));
  const std::string temporary(reinterpret_cast<const char*>(name.data()), name.size());
  // Each rank opens the file by itself. If all ranks opened it in one collective call and the call
  // failed on one rank, the other ranks might wait forever.
  ranks.together([&] {
    check(MPI_File_open(MPI_COMM_SELF, temporary.c_str(), MPI_MODE_WRONLY, MPI_INFO_NULL,
                        &handle_->file),
          path_);
  });
}

SharedOutput::~SharedOutput() { close(); }

void SharedOutput::close() {
  if (handle_->file != MPI_FILE_NULL) MPI_File_close(&handle_->file);
}

void SharedOutput::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const int count = static_cast<int>(std::min(kPiece, bytes.size()));
    MPI_Status status;
    check(MPI_File_write_at(handle_->file, static_cast<MPI_Offset>(offset), bytes.data(), count,
                            MPI_BYTE, &status),
          path_);
    int written = 0;
    MPI_Get_count(&status, MPI_BYTE, &written);
    if (written <= 0 || written > count)
      throw Failure(ErrorCode::output, "cannot be written", path_);
    offset += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void SharedOutput::commit() {
  ranks_->together([&] {
    check(MPI_File_sync(handle_->file), path_);
    check(MPI_File_close(&handle_->file), path_);
  });
  ranks_->together([&] {
    if (file_) file_->commit();
  });
}

}  // namespace shm::converters
