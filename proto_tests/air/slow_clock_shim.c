/* Slows time down for a program, and for all that it starts:
 *
 *   LD_PRELOAD=build/gate/tests/libslow_clock_shim.so SLOW_CLOCK=4 PROGRAM ...
 *
 * Clocks run at a quarter of their speed, and whoever waits waits four times as long. A pause of
 * the machine of 20 ms is one of 5 ms then: what robots do in real time can be looked at on a
 * machine that other machines share. CLOCK_MONOTONIC is a quarter of the machine's, so that it is
 * the same in all programs; UTC is behind.
 *
 * A deadline below 10^9 s is taken for one of CLOCK_MONOTONIC. Not slowed: std::future::wait_for
 * and Python's locks, which ask the kernel in other ways, and timers of terminals. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/select.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

static const int64_t kSecond = 1000000000;
static const int64_t kMs = 1000000;
static const size_t kSignals = 64; /* as many as the kernel's masks have */

static int64_t Times(void) {
  const char* text = getenv("SLOW_CLOCK");
  const long times = text == NULL ? 1 : atol(text);
  return times < 1 ? 1 : times;
}

static int64_t InNs(const struct timespec* time) {
  return time->tv_sec * kSecond + time->tv_nsec;
}

static struct timespec OfNs(int64_t ns) {
  return (struct timespec){ns / kSecond, ns % kSecond};
}

static int64_t Real(clockid_t clock) {
  struct timespec now;
  syscall(SYS_clock_gettime, clock, &now);
  return InNs(&now);
}

/* Both clocks of one moment, also if the program has just paused: time must not jump and go back.
 */
static int64_t Slow(clockid_t clock) {
  int64_t monotonic = Real(CLOCK_MONOTONIC);
  if (clock == CLOCK_MONOTONIC) {
    return monotonic / Times();
  }
  int64_t now = Real(clock);
  while (Real(CLOCK_MONOTONIC) - monotonic > kMs / 10) {
    monotonic = Real(CLOCK_MONOTONIC);
    now = Real(clock);
  }
  return now - monotonic + monotonic / Times();
}

/* When the real clock shows what the slow one will show as `deadline`. */
static struct timespec RealDeadline(clockid_t clock, const struct timespec* deadline) {
  const int64_t left = InNs(deadline) - Slow(clock);
  return OfNs(left <= 0 ? 1 : Real(clock) + left * Times());
}

static clockid_t ClockOf(const struct timespec* deadline) {
  return deadline->tv_sec < kSecond ? CLOCK_MONOTONIC : CLOCK_REALTIME;
}

int clock_gettime(clockid_t clock, struct timespec* now) {
  if (clock == CLOCK_PROCESS_CPUTIME_ID || clock == CLOCK_THREAD_CPUTIME_ID || clock < 0) {
    return (int)syscall(SYS_clock_gettime, clock, now);
  }
  *now = OfNs(Slow(clock));
  return 0;
}

int gettimeofday(struct timeval* now, void* zone) {
  const int64_t ns = Slow(CLOCK_REALTIME);
  (void)zone;
  *now = (struct timeval){ns / kSecond, ns % kSecond / 1000};
  return 0;
}

time_t time(time_t* now) {
  const time_t seconds = Slow(CLOCK_REALTIME) / kSecond;
  if (now != NULL) {
    *now = seconds;
  }
  return seconds;
}

/* An error's number, as clock_nanosleep(3) returns it. */
int clock_nanosleep(clockid_t clock, int flags, const struct timespec* asked,
                    struct timespec* left) {
  const struct timespec real =
      (flags & TIMER_ABSTIME) != 0 ? RealDeadline(clock, asked) : OfNs(InNs(asked) * Times());
  return syscall(SYS_clock_nanosleep, clock, flags, &real, left) == 0 ? 0 : errno;
}

int nanosleep(const struct timespec* asked, struct timespec* left) {
  const struct timespec real = OfNs(InNs(asked) * Times());
  return (int)syscall(SYS_clock_nanosleep, CLOCK_MONOTONIC, 0, &real, left);
}

int usleep(useconds_t us) {
  const struct timespec asked = OfNs((int64_t)us * 1000);
  return nanosleep(&asked, NULL);
}

int ppoll(struct pollfd* files, nfds_t count, const struct timespec* timeout,
          const sigset_t* mask) {
  struct timespec real = OfNs(timeout == NULL ? 0 : InNs(timeout) * Times());
  return (int)syscall(SYS_ppoll, files, count, timeout == NULL ? NULL : &real, mask, kSignals / 8);
}

int poll(struct pollfd* files, nfds_t count, int timeout_ms) {
  const struct timespec timeout = OfNs(timeout_ms * kMs);
  return ppoll(files, count, timeout_ms < 0 ? NULL : &timeout, NULL);
}

int epoll_wait(int epoll, struct epoll_event* events, int count, int timeout_ms) {
  return (int)syscall(SYS_epoll_pwait, epoll, events, count,
                      timeout_ms <= 0 ? timeout_ms : (int)(timeout_ms * Times()), NULL, 0);
}

int select(int count, fd_set* readable, fd_set* writable, fd_set* urgent, struct timeval* timeout) {
  struct timespec real = {0, 0};
  if (timeout != NULL) {
    real = OfNs((timeout->tv_sec * kSecond + timeout->tv_usec * 1000) * Times());
  }
  return (int)syscall(SYS_pselect6, count, readable, writable, urgent,
                      timeout == NULL ? NULL : &real, NULL);
}

int timerfd_settime(int timer, int flags, const struct itimerspec* asked,
                    struct itimerspec* before) {
  struct itimerspec real = {OfNs(InNs(&asked->it_interval) * Times()), asked->it_value};
  if (InNs(&asked->it_value) != 0) {
    real.it_value = (flags & TFD_TIMER_ABSTIME) != 0
                        ? RealDeadline(ClockOf(&asked->it_value), &asked->it_value)
                        : OfNs(InNs(&asked->it_value) * Times());
  }
  return (int)syscall(SYS_timerfd_settime, timer, flags, &real, before);
}

int pthread_cond_clockwait(pthread_cond_t* condition, pthread_mutex_t* mutex, clockid_t clock,
                           const struct timespec* deadline) {
  int (*next)(pthread_cond_t*, pthread_mutex_t*, clockid_t, const struct timespec*) = NULL;
  const struct timespec real = RealDeadline(clock, deadline);
  *(void**)&next = dlsym(RTLD_NEXT, "pthread_cond_clockwait");
  return next(condition, mutex, clock, &real);
}

int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex,
                           const struct timespec* deadline) {
  return pthread_cond_clockwait(condition, mutex, ClockOf(deadline), deadline);
}
