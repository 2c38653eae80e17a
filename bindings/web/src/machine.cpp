// What the decoder has around it as WebAssembly: three functions of the page, as the callbacks of
// shmformat.h, and an end where a program would throw or stop. JavaScript calls shmf_* by itself.
//
// There are no exceptions here. Where memory runs out the last words are left where the page finds
// them, and the instance traps: the page throws it away, with all that it had open. No call returns
// with less than it was asked for.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <new>
#include <typeinfo>

#include "shmformat.h"

#define SHM_FROM_PAGE(name) __attribute__((import_module("page"), import_name(name)))

extern "C" {

SHM_FROM_PAGE("read_at")
int page_read_at(void* context, uint64_t offset, void* into, uint64_t count, char* why,
                 size_t why_bytes);
SHM_FROM_PAGE("prefetch")
void page_prefetch(void* context, const shmf_range* ranges, size_t count);
SHM_FROM_PAGE("progress")
int page_progress(void* context, double done);

// Of these the page makes its own, with a context and a size: it can call functions of ours, but
// has no pointers to its own.
extern const shmf_source shmf_page_source = {sizeof(shmf_source), nullptr, 0,
                                             page_read_at,        nullptr, page_prefetch};
extern const shmf_run_options shmf_page_run = {sizeof(shmf_run_options), page_progress, nullptr, 0,
                                               0};

// Why the instance ended, a sentence; null as long as it lives.
extern const char* shmf_page_last_words;
const char* shmf_page_last_words = nullptr;
}

namespace {

constexpr const char* kNoMemory = "out of memory";

[[noreturn]] void end(const char* last_words) {
  shmf_page_last_words = last_words;
  __builtin_trap();
}

void* allocated(std::size_t bytes) {
  if (void* place = std::malloc(bytes != 0 ? bytes : 1)) return place;
  end(kNoMemory);
}

/// Whether an exception of this name is what shmf_* would return SHMF_NO_MEMORY for: more than
/// there is, or than there can be.
bool is_of_memory(const char* name) {
  for (const char* one : {"bad_alloc", "length_error", "bad_array_new_length"})
    if (std::strstr(name, one) != nullptr) return true;
  return false;
}

[[noreturn]] void end_of_throw(const char* name) {
  end(is_of_memory(name) ? kNoMemory : "an exception of an unknown kind");
}

}  // namespace

void* operator new(std::size_t bytes) { return allocated(bytes); }
void* operator new[](std::size_t bytes) { return allocated(bytes); }
void operator delete(void* place) noexcept { std::free(place); }
void operator delete[](void* place) noexcept { std::free(place); }
void operator delete(void* place, std::size_t) noexcept { std::free(place); }
void operator delete[](void* place, std::size_t) noexcept { std::free(place); }

// What a throw calls.
extern "C" void* __cxa_allocate_exception(std::size_t bytes) noexcept {
  alignas(16) static char only[64];
  return bytes <= sizeof only ? only : allocated(bytes);
}
extern "C" [[noreturn]] void __cxa_throw(void* /*thrown*/, std::type_info* type,
                                         void (* /*destructor*/)(void*)) {
  end_of_throw(type->name());
}

// What the C++ library, compiled without exceptions, calls instead: the text names the one that
// it would have thrown.
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char* text, ...) { end_of_throw(text); }
_LIBCPP_END_NAMESPACE_STD

// Of what cannot happen, as a call of a function that is pure virtual.
extern "C" [[noreturn]] void abort_message(const char* /*text*/, ...) {
  end("the C++ library gave up");
}
