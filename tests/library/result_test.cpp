// Tests of Result. A Result never throws: if a caller takes the value of a Result that contains an
// error, the program is terminated.
#include "shm/result.h"

#include <gtest/gtest.h>

#include <csignal>
#include <memory>
#include <string>
#include <utility>

namespace shm {
namespace {

using Text = Result<std::string>;
static_assert(noexcept(*std::declval<Text&>()));
static_assert(noexcept(*std::declval<const Text&>()));
static_assert(noexcept(*std::declval<Text>()));
static_assert(noexcept(std::declval<Text&>().value()));
static_assert(noexcept(std::declval<Text&>().operator->()));
static_assert(noexcept(std::declval<const Text&>().error()));
static_assert(noexcept(std::declval<const Result<>&>().error()));

TEST(Result, HoldsAValueOrAnError) {
  Result<std::unique_ptr<int>> number(std::make_unique<int>(7));
  ASSERT_TRUE(number);
  EXPECT_EQ(**number, 7);
  const std::unique_ptr<int> taken = *std::move(number);
  EXPECT_EQ(*taken, 7);
  const Text failed(Error{ErrorCode::misuse, "no", {}, kNoOffset, {}});
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().detail, "no");
}

TEST(ResultDeathTest, AskingForWhatIsNotThereEndsTheProgram) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const Text failed(Error{}), good("yes");
  const auto done = std::make_unique<const Result<>>();
#if defined(_WIN32)
  const auto killed = testing::ExitedWithCode(3);  // on Windows, abort() exits with code 3
#else
  const auto killed = testing::KilledBySignal(SIGABRT);
#endif
  EXPECT_EXIT((void)*failed, killed, "");
  EXPECT_EXIT((void)failed->size(), killed, "");
  EXPECT_EXIT((void)good.error(), killed, "");
  EXPECT_EXIT((void)done->error(), killed, "");
}

}  // namespace
}  // namespace shm
