// Compares Exodus files with netCDF's own tools.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace shm::converters {

// Compares two files with netCDF's own tools. If the files differ, the test failure lists the
// differences.
inline testing::AssertionResult equal_files(const std::string& a, const std::string& b) {
  const std::string report = b + ".report";
  const std::string command = "python3 '" SHM_SOURCE_DIR "/tests/support/exodus_oracle.py' '" + a +
                              "' '" + b + "' > '" + report + "' 2>&1";
  if (std::system(command.c_str()) == 0) return testing::AssertionSuccess();
  std::ifstream in(report);
  return testing::AssertionFailure() << a << ":\n" << std::string(std::istreambuf_iterator(in), {});
}

}  // namespace shm::converters
