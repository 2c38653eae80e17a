// Connects the decoder, compiled to WebAssembly, to JavaScript. This file declares three JavaScript
// functions, which are the callbacks of shmformat.h, and defines functions that end the WebAssembly
// instance when native code would throw an exception or abort. JavaScript calls the shmf_*
// functions directly.
//
// The module is built without exceptions. If memory runs out, the module stores a message at an
// address that JavaScript knows, and traps. JavaScript then discards the instance and all files
// that were open in it, so no code of the instance runs after a failed allocation.
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

// Initial values of two structs, with function pointers, which JavaScript cannot create. JavaScript
// copies such a struct and sets the other members.
extern const shmf_source shmf_page_source = {sizeof(shmf_source), nullptr, 0,
                                             page_read_at,        nullptr, page_prefetch};
extern const shmf_run_options shmf_page_run = {sizeof(shmf_run_options), page_progress, nullptr, 0,
                                               0};

// A sentence that says why the instance ended; null while the instance can be used.
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

/// Returns true if an exception with this name means that memory ran out, or that a size exceeds
/// the limit of a container. The native functions shmf_* return SHMF_NO_MEMORY for these
/// exceptions.
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

// Throw expressions call these two functions.
extern "C" void* __cxa_allocate_exception(std::size_t bytes) noexcept {
  alignas(16) static char only[64];
  return bytes <= sizeof only ? only : allocated(bytes);
}
extern "C" [[noreturn]] void __cxa_throw(void* /*thrown*/, std::type_info* type,
                                         void (* /*destructor*/)(void*)) {
  end_of_throw(type->name());
}

// The C++ library is compiled without exceptions, and calls this function instead of throwing.
// `text` contains the name of the exception.
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char* text, ...) { end_of_throw(text); }
_LIBCPP_END_NAMESPACE_STD

// Ends the instance. The C++ library calls this function for errors that never occur in correct
// code, such as a call to a pure virtual function.
extern "C" [[noreturn]] void abort_message(const char* /*text*/, ...) {
  end("the C++ library aborted");
}
