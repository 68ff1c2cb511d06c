// What slow_clock_shim.c, with which this is started, makes of clocks and of all ways to wait. The
// judge is the kernel's clock, asked past the shim. All bounds hold on a machine that pauses, too.
#include <gtest/gtest.h>
#include <poll.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/select.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <mutex>
#include <utility>

namespace {

using std::chrono::steady_clock;
using std::chrono::system_clock;

constexpr int kWaitMs = 20;

int64_t Ns(const timespec& time) {
  return int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

int64_t RealNs() {
  timespec now{};
  syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
  return Ns(now);
}

int Times() {
  const char* times = std::getenv("SLOW_CLOCK");
  return times == nullptr ? 0 : std::atoi(times);
}

void WaitForTimer(int flags, const timespec& at) {
  const int timer = timerfd_create(CLOCK_MONOTONIC, 0);
  const itimerspec asked{{}, at};
  uint64_t count = 0;
  ASSERT_EQ(0, timerfd_settime(timer, flags, &asked, nullptr));
  ASSERT_EQ(ssize_t{sizeof count}, read(timer, &count, sizeof count));
  close(timer);
}

timespec InAMoment(clockid_t clock = CLOCK_MONOTONIC) {
  timespec at{};
  clock_gettime(clock, &at);
  const int64_t ns = Ns(at) + kWaitMs * 1'000'000;
  return {ns / 1'000'000'000, ns % 1'000'000'000};
}

TEST(SlowClock, WhoeverWaitsWaitsSoManyTimesAsLong) {
  ASSERT_EQ(4, Times());
  std::mutex mutex;
  std::condition_variable condition;
  std::unique_lock lock(mutex);
  const timespec moment{0, kWaitMs * 1'000'000};
  const std::pair<const char*, std::function<void()>> ways[] = {
      {"nanosleep", [&] { nanosleep(&moment, nullptr); }},
      {"clock_nanosleep", [&] { clock_nanosleep(CLOCK_MONOTONIC, 0, &moment, nullptr); }},
      {"until",
       [] {
         const timespec at = InAMoment();
         clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
       }},
      {"usleep", [] { usleep(kWaitMs * 1000); }},
      {"poll", [] { poll(nullptr, 0, kWaitMs); }},
      {"ppoll", [&] { ppoll(nullptr, 0, &moment, nullptr); }},
      {"select",
       [] {
         timeval timeout{0, kWaitMs * 1000};
         select(0, nullptr, nullptr, nullptr, &timeout);
       }},
      {"epoll_wait",
       [] {
         epoll_event event{};
         const int epoll = epoll_create1(0);
         epoll_wait(epoll, &event, 1, kWaitMs);
         close(epoll);
       }},
      {"a timer", [&] { WaitForTimer(0, moment); }},
      {"a timer's deadline", [] { WaitForTimer(TFD_TIMER_ABSTIME, InAMoment()); }},
      {"wait_for", [&] { condition.wait_for(lock, std::chrono::milliseconds(kWaitMs)); }},
      {"a deadline of UTC", [&] {
         const timespec at = InAMoment(CLOCK_REALTIME);
         pthread_cond_timedwait(condition.native_handle(), mutex.native_handle(), &at);
       }}};
  for (const auto& [name, wait] : ways) {
    const int64_t real = RealNs();
    const steady_clock::time_point slow = steady_clock::now();
    wait();
    // UTC may be off by less than 0.1 ms.
    EXPECT_GE(steady_clock::now() - slow, std::chrono::milliseconds(kWaitMs - 1)) << name;
    EXPECT_GE(RealNs() - real, int64_t{Times()} * (kWaitMs - 1) * 1'000'000) << name;
  }
}

TEST(SlowClock, ItIsAQuarterOfTheMachinesAndDoesNotGoBack) {
  int64_t last = 0;
  for (int i = 0; i < 100'000; ++i) {
    const int64_t before = RealNs();
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    const int64_t ns = Ns(now);
    ASSERT_GE(ns, last);
    ASSERT_GE(ns, before / Times());
    ASSERT_LE(ns, RealNs() / Times());
    last = ns;
  }
}

TEST(SlowClock, UtcRunsWithItHoweverItIsAsked) {
  const auto us_of = [](auto asked) {
    return std::chrono::duration_cast<std::chrono::microseconds>(asked.time_since_epoch()).count();
  };
  for (int i = 0; i < 20'000; ++i) {
    const int64_t from_us = us_of(steady_clock::now());
    const int64_t utc_us = us_of(system_clock::now());
    timeval now{};
    gettimeofday(&now, nullptr);
    const int64_t passed_us = now.tv_sec * 1'000'000 + now.tv_usec - utc_us;
    const int64_t later_s = time(nullptr);
    ASSERT_GE(passed_us, -200);
    ASSERT_LE(passed_us, us_of(steady_clock::now()) - from_us + 200);
    ASSERT_GE(later_s, (utc_us - 200) / 1'000'000);
    ASSERT_LE(later_s, us_of(system_clock::now()) / 1'000'000 + 1);
  }
}

}  // namespace
