/* Lets libserialport open a pseudo-terminal, for tests on machines without serial ports. It looks a
 * port up in sysfs and asks for its modem lines, and a pseudo-terminal has neither: here, one that
 * exists has an entry, and lines that are all off. Linked into a test, or preloaded:
 *
 *   LD_PRELOAD=build/release/tests/libpty_as_serial_shim.so pheromoned ...
 *
 * A test that is linked with it may play the modem and the driver (pty_as_serial_shim.h).
 *
 * Everything else goes to the system as it is. */
#define _GNU_SOURCE
#include "server/links/testing/pty_as_serial_shim.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t released = PTHREAD_COND_INITIALIZER;
static int hangs;
static int held;
static int inputs;
static int outputs;
static int has_counts;
static struct PtyShimCounts counts;
static struct PtyShimRs485 rs485;

void PtyShimSetInputs(int lines) {
  pthread_mutex_lock(&lock);
  inputs = lines;
  pthread_mutex_unlock(&lock);
}

int PtyShimOutputs(void) {
  pthread_mutex_lock(&lock);
  const int lines = outputs;
  pthread_mutex_unlock(&lock);
  return lines;
}

void PtyShimHang(int hang) {
  pthread_mutex_lock(&lock);
  hangs = hang;
  pthread_cond_broadcast(&released);
  pthread_mutex_unlock(&lock);
}

int PtyShimHeld(void) {
  pthread_mutex_lock(&lock);
  const int now = held;
  pthread_mutex_unlock(&lock);
  return now;
}

void PtyShimSetCounts(struct PtyShimCounts now) {
  pthread_mutex_lock(&lock);
  has_counts = 1;
  counts = now;
  pthread_mutex_unlock(&lock);
}

void PtyShimSetRs485(int supported) {
  pthread_mutex_lock(&lock);
  memset(&rs485, 0, sizeof rs485);
  rs485.supported = supported;
  pthread_mutex_unlock(&lock);
}

struct PtyShimRs485 PtyShimGetRs485(void) {
  pthread_mutex_lock(&lock);
  const struct PtyShimRs485 now = rs485;
  pthread_mutex_unlock(&lock);
  return now;
}

static const char kClass[] = "/sys/class/tty/pts/";

static int IsPtyEntry(const char* path) {
  char device[64];
  if (strncmp(path, kClass, sizeof kClass - 1) != 0) {
    return 0;
  }
  snprintf(device, sizeof device, "/dev/pts/%s", path + sizeof kClass - 1);
  return access(device, F_OK) == 0;
}

/* What lstat was in programs built for C libraries before 2.33. */
int __lxstat(int version, const char* path, struct stat* status);
int __lxstat(int version, const char* path, struct stat* status) {
  (void)version;
  if (IsPtyEntry(path)) {
    memset(status, 0, sizeof *status);
    status->st_mode = S_IFLNK | 0777;
    return 0;
  }
  return fstatat(AT_FDCWD, path, status, AT_SYMLINK_NOFOLLOW);
}

int lstat(const char* path, struct stat* status) {
  return __lxstat(0, path, status);
}

ssize_t readlink(const char* path, char* buffer, size_t size) {
  static const char kTarget[] = "../../devices/virtual/tty/pts";
  if (IsPtyEntry(path) && size >= sizeof kTarget) {
    memcpy(buffer, kTarget, sizeof kTarget);
    return sizeof kTarget - 1;
  }
  return (ssize_t)syscall(SYS_readlinkat, AT_FDCWD, path, buffer, size);
}

/* What a serial port would have done; under the lock. An errno, or 0. */
static int Fake(unsigned long request, void* argument) {
  if (request == TIOCMGET || request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC ||
      request == TIOCGICOUNT) {
    ++held;
    while (hangs) {
      pthread_cond_wait(&released, &lock);
    }
    --held;
  }
  if (request == TIOCMGET) {
    *(int*)argument = inputs | outputs;
  } else if (request == TIOCMSET) {
    outputs = *(const int*)argument;
  } else if (request == TIOCMBIS) {
    outputs |= *(const int*)argument;
  } else if (request == TIOCMBIC) {
    outputs &= ~*(const int*)argument;
  } else if (request == TIOCGICOUNT && has_counts) {
    struct serial_icounter_struct* now = argument;
    memset(now, 0, sizeof *now);
    now->frame = counts.framing;
    now->parity = counts.parity;
    now->overrun = counts.overruns;
    now->buf_overrun = counts.buffer_overruns;
    now->brk = counts.breaks;
  } else if (request == TIOCSRS485 && rs485.supported) {
    const struct serial_rs485* settings = argument;
    rs485.flags = (int)settings->flags;
    rs485.delay_before_ms = (int)settings->delay_rts_before_send;
    rs485.delay_after_ms = (int)settings->delay_rts_after_send;
  } else {
    return ENOTTY;
  }
  return 0;
}

int ioctl(int descriptor, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  long result = syscall(SYS_ioctl, descriptor, request, argument);
  int error = errno;
  if (result == -1 && (error == ENOTTY || error == EINVAL) && isatty(descriptor)) {
    pthread_mutex_lock(&lock);
    error = Fake(request, argument);
    pthread_mutex_unlock(&lock);
    result = error == 0 ? 0 : -1;
  }
  errno = error;
  return (int)result;
}
