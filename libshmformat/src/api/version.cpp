#include "shm/version.h"

namespace shm {

Version library_version() { return {}; }

}  // namespace shm
