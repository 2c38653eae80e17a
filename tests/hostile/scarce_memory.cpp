// Simulates a lack of memory in a program into which this library is loaded (LD_PRELOAD). After
// SHM_ALLOCATIONS calls to operator new, the next call fails. If SHM_FOR_GOOD=1, all later calls
// fail, too. Calls are counted from the start of main(), because the program cannot handle failures
// while its libraries are loaded. If SHM_MALLOC=1, calls to malloc, calloc and realloc, which C
// libraries use, are counted, too. SHM_COUNT is the name of a file to which the library writes the
// number of calls when the program ends.
#include <dlfcn.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <new>

namespace {

long number_in(const char* name, long otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atol(text);
}

std::atomic<bool> is_running{false};
std::atomic<long> allocations{0};

// Settings from the environment. run() reads them immediately before main(), so all allocations
// before main() succeed.
long allowed = -1;
bool for_good = false, with_malloc = false;

bool fails() {
  if (!is_running) return false;
  const long before = allocations++;
  const bool now = allowed >= 0 && (for_good ? before >= allowed : before == allowed);
  if (now) errno = ENOMEM;
  return now;
}

void write_count() {
  is_running = false;
  const char* path = std::getenv("SHM_COUNT");
  std::FILE* file = path == nullptr ? nullptr : std::fopen(path, "w");
  if (file == nullptr) return;
  std::fprintf(file, "%ld\n", allocations.load());
  std::fclose(file);
}

extern "C" void* __libc_malloc(std::size_t bytes);
extern "C" void* __libc_calloc(std::size_t count, std::size_t bytes);
extern "C" void* __libc_realloc(void* memory, std::size_t bytes);

void* taken(std::size_t bytes) { return fails() ? nullptr : __libc_malloc(bytes > 0 ? bytes : 1); }

void* taken(std::size_t bytes, std::align_val_t alignment) {
  void* memory = nullptr;
  if (fails()) return nullptr;
  return ::posix_memalign(&memory, static_cast<std::size_t>(alignment), bytes) == 0 ? memory
                                                                                    : nullptr;
}

void* or_throw(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

using Main = int (*)(int, char**, char**);
static Main program = nullptr;
static int run(int argc, char** argv, char** environment) {
  allowed = number_in("SHM_ALLOCATIONS", -1);
  for_good = number_in("SHM_FOR_GOOD", 0) != 0;
  with_malloc = number_in("SHM_MALLOC", 0) != 0;
  std::atexit(write_count);
  is_running = true;
  return program(argc, argv, environment);
}
extern "C" int __libc_start_main(Main main, int argc, char** argv, void (*begin)(), void (*end)(),
                                 void (*of_loader)(), void* stack) {
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  program = main;
  const auto start = reinterpret_cast<Start>(::dlsym(RTLD_NEXT, "__libc_start_main"));
  return start(run, argc, argv, begin, end, of_loader, stack);
}

extern "C" void* malloc(std::size_t bytes) {
  return with_malloc && fails() ? nullptr : __libc_malloc(bytes);
}
extern "C" void* calloc(std::size_t count, std::size_t bytes) {
  return with_malloc && fails() ? nullptr : __libc_calloc(count, bytes);
}
extern "C" void* realloc(void* memory, std::size_t bytes) {
  return with_malloc && fails() ? nullptr : __libc_realloc(memory, bytes);
}

using Alignment = std::align_val_t;
void* operator new(std::size_t n) { return or_throw(taken(n)); }
void* operator new[](std::size_t n) { return or_throw(taken(n)); }
void* operator new(std::size_t n, const std::nothrow_t&) noexcept { return taken(n); }
void* operator new[](std::size_t n, const std::nothrow_t&) noexcept { return taken(n); }
void* operator new(std::size_t n, Alignment a) { return or_throw(taken(n, a)); }
void* operator new[](std::size_t n, Alignment a) { return or_throw(taken(n, a)); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, Alignment) noexcept { std::free(p); }
void operator delete[](void* p, Alignment) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, Alignment) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, Alignment) noexcept { std::free(p); }
