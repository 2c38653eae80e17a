#include "exodus/parts/ranks.h"

#include <exception>
#include <new>
#include <stdexcept>

namespace shm::converters {

Error current_error() {
  try {
    throw;
  } catch (const Failure& failure) {
    return failure.error();
  } catch (const std::bad_alloc&) {
    return Error{.code = ErrorCode::over_limit, .detail = "needs more memory than there is"};
  } catch (const std::length_error&) {
    return Error{.code = ErrorCode::over_limit, .detail = "needs more memory than there is"};
  } catch (const std::exception& error) {
    return Error{.code = ErrorCode::corrupt, .detail = error.what()};
  }
}

void Ranks::together(const std::function<void()>& work) {
  std::optional<Error> error;
  try {
    work();
  } catch (const SharedFailure&) {
    throw;  // all ranks throw this SharedFailure, so agree() need not be called
  } catch (...) {
    error = current_error();
  }
  agree(error);
}

}  // namespace shm::converters
