#include "mpi/mpi_ranks.h"

#include <mpi.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "tool/support.h"

namespace shm::converters {
namespace {

constexpr std::size_t kMessage = std::size_t{1} << 26;  // maximum size of a message in bytes
constexpr int kTag = 1;

// The results of MPI functions are not checked, because by default an error in an MPI function ends
// the program.

std::vector<std::byte> packed(const Error& error) {
  std::vector<std::byte> bytes;
  const auto put = [&](const void* from, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(from);
    bytes.insert(bytes.end(), begin, begin + size);
  };
  put(&error.code, sizeof error.code);
  put(&error.offset, sizeof error.offset);
  for (const std::string* text : {&error.detail, &error.section, &error.file}) {
    const std::uint64_t size = text->size();
    put(&size, sizeof size);
    put(text->data(), text->size());
  }
  return bytes;
}

Error unpacked(const std::vector<std::byte>& bytes) {
  Error error{.code = ErrorCode::io};
  const std::byte* next = bytes.data();
  const auto get = [&](void* to, std::size_t size) {
    std::memcpy(to, next, size);
    next += size;
  };
  get(&error.code, sizeof error.code);
  get(&error.offset, sizeof error.offset);
  for (std::string* text : {&error.detail, &error.section, &error.file}) {
    std::uint64_t size = 0;
    get(&size, sizeof size);
    text->resize(size);
    if (size > 0) get(text->data(), size);
  }
  return error;
}

// Initializes MPI. Returns the rank and the number of ranks.
std::pair<std::size_t, std::size_t> place_of_process(int* argc, char*** argv) {
  MPI_Init(argc, argv);
  int rank = 0, size = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return {static_cast<std::size_t>(rank), static_cast<std::size_t>(size)};
}

}  // namespace

MpiRanks::MpiRanks(int* argc, char*** argv) : MpiRanks(place_of_process(argc, argv)) {}

MpiRanks::~MpiRanks() {
  // When one process exits with an error code, mpirun ends all other processes. Therefore wait here
  // until all processes have finished their work.
  MPI_Barrier(MPI_COMM_WORLD);
  MPI_Finalize();
}

void MpiRanks::abort(int code) {
  MPI_Abort(MPI_COMM_WORLD, code);
  std::abort();
}

void MpiRanks::uninterrupted(const std::function<void()>& calls) {
  try {
    calls();
  } catch (const SharedFailure&) {
    throw;
  } catch (...) {
    abort_with([] {
      const Error error = current_error();
      std::fprintf(stderr, "shm_mpi: %s\n", error.message().c_str());
      return exit_code(error.code);
    });
  }
}

void MpiRanks::abort_with(const std::function<int()>& complain) noexcept {
  int code = kLimit;
  try {
    code = complain();
  } catch (...) {  // not enough memory to format the message
    std::fputs("shm_mpi: needs more memory than there is\n", stderr);
  }
  abort(code);
}

void MpiRanks::agree(const std::optional<Error>& error) {
  const std::uint64_t failed = smallest(error ? rank() : size());
  if (failed == size()) return;
  throw SharedFailure(
      unpacked(broadcast(rank() == failed ? packed(*error) : std::vector<std::byte>(), failed)));
}

std::uint64_t MpiRanks::largest(std::uint64_t value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_UINT64_T, MPI_MAX, MPI_COMM_WORLD);
  return value;
}

std::uint64_t MpiRanks::smallest(std::uint64_t value) {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_UINT64_T, MPI_MIN, MPI_COMM_WORLD);
  return value;
}

auto MpiRanks::sums(std::vector<std::uint64_t> values) -> Sums {
  const int count = static_cast<int>(values.size());
  Sums sums{std::vector<std::uint64_t>(values.size()), values};
  MPI_Exscan(values.data(), sums.before.data(), count, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
  // MPI_Exscan does not define the result on rank 0, which must be 0.
  if (first()) sums.before.assign(values.size(), 0);
  MPI_Allreduce(MPI_IN_PLACE, sums.all.data(), count, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
  return sums;
}

std::uint64_t MpiRanks::broadcast(std::uint64_t value, std::size_t from) {
  MPI_Bcast(&value, 1, MPI_UINT64_T, static_cast<int>(from), MPI_COMM_WORLD);
  return value;
}

std::vector<std::byte> MpiRanks::broadcast(std::vector<std::byte> bytes, std::size_t from) {
  bytes.resize(broadcast(std::uint64_t{bytes.size()}, from));
  for (std::size_t offset = 0; offset < bytes.size(); offset += kMessage)
    MPI_Bcast(bytes.data() + offset, static_cast<int>(std::min(kMessage, bytes.size() - offset)),
              MPI_BYTE, static_cast<int>(from), MPI_COMM_WORLD);
  return bytes;
}

void MpiRanks::gather(std::span<const std::byte> bytes,
                      const std::function<void(std::size_t, std::vector<std::byte>)>& take) {
  if (!first()) {
    std::uint64_t size = bytes.size();
    MPI_Send(&size, 1, MPI_UINT64_T, 0, kTag, MPI_COMM_WORLD);
    for (std::size_t offset = 0; offset < bytes.size(); offset += kMessage)
      MPI_Send(bytes.data() + offset, static_cast<int>(std::min(kMessage, bytes.size() - offset)),
               MPI_BYTE, 0, kTag, MPI_COMM_WORLD);
    return;
  }
  take(0, {bytes.begin(), bytes.end()});
  for (std::size_t r = 1; r < size(); ++r) {
    std::uint64_t size = 0;
    MPI_Recv(&size, 1, MPI_UINT64_T, static_cast<int>(r), kTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    std::vector<std::byte> got(size);
    for (std::size_t offset = 0; offset < size; offset += kMessage)
      MPI_Recv(got.data() + offset,
               static_cast<int>(std::min<std::size_t>(kMessage, size - offset)), MPI_BYTE,
               static_cast<int>(r), kTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    take(r, std::move(got));
  }
}

std::vector<std::byte> MpiRanks::exchange_bytes(std::vector<std::byte> packed,
                                                std::vector<std::size_t>& bytes) {
  std::vector<int> send(size()), receive(size()), send_at(size()), receive_at(size());
  for (std::size_t r = 0; r < size(); ++r) send[r] = static_cast<int>(bytes[r]);
  MPI_Alltoall(send.data(), 1, MPI_INT, receive.data(), 1, MPI_INT, MPI_COMM_WORLD);
  std::size_t sent = 0, received = 0;
  for (std::size_t r = 0; r < size(); ++r) {
    send_at[r] = static_cast<int>(sent);
    receive_at[r] = static_cast<int>(received);
    sent += bytes[r];
    bytes[r] = static_cast<std::size_t>(receive[r]);
    received += bytes[r];
  }
  if (received > static_cast<std::size_t>(std::numeric_limits<int>::max())) abort(kLimit);
  std::vector<std::byte> got(received);
  MPI_Alltoallv(packed.data(), send.data(), send_at.data(), MPI_BYTE, got.data(), receive.data(),
                receive_at.data(), MPI_BYTE, MPI_COMM_WORLD);
  return got;
}

}  // namespace shm::converters
