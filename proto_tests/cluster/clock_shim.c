/* Sets the clock of one program, which is started with
 *
 *   LD_PRELOAD=build/gate/tests/libclock_shim.so CLOCK_AHEAD=FILE pheromoned ...
 *
 * UTC is ahead by the seconds that FILE holds, as a decimal number; other clocks are as they are.
 */
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static time_t Ahead(void) {
  const char* path = getenv("CLOCK_AHEAD");
  char text[32] = "";
  const int file = path == NULL ? -1 : open(path, O_RDONLY | O_CLOEXEC);
  if (file >= 0) {
    const ssize_t size = read(file, text, sizeof text - 1);
    text[size > 0 ? size : 0] = '\0';
    close(file);
  }
  return (time_t)atol(text);
}

int clock_gettime(clockid_t clock, struct timespec* now) {
  const int status = (int)syscall(SYS_clock_gettime, clock, now);
  if (status == 0 && clock == CLOCK_REALTIME) {
    now->tv_sec += Ahead();
  }
  return status;
}

int gettimeofday(struct timeval* now, void* zone) {
  struct timespec precise;
  const int status = clock_gettime(CLOCK_REALTIME, &precise);
  (void)zone;
  now->tv_sec = precise.tv_sec;
  now->tv_usec = precise.tv_nsec / 1000;
  return status;
}

time_t time(time_t* now) {
  struct timespec precise;
  (void)clock_gettime(CLOCK_REALTIME, &precise);
  if (now != NULL) {
    *now = precise.tv_sec;
  }
  return precise.tv_sec;
}
