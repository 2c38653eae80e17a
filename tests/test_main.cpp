// Runs the test cases of a GoogleTest program. If no case fails and a case is skipped, the exit
// code is 77, which ctest reports as skipped (SKIP_RETURN_CODE). A failed case is never hidden by a
// skipped one.
#include <gtest/gtest.h>

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const int code = RUN_ALL_TESTS();
  const bool skipped = ::testing::UnitTest::GetInstance()->skipped_test_count() > 0;
  return code == 0 && skipped ? 77 : code;
}
