/* Lets libserialport open a pseudo-terminal, for tests on machines without serial ports. It looks a
 * port up in sysfs and asks for its modem lines, and a pseudo-terminal has neither: here, one that
 * exists has an entry, and lines that are all off. Linked into a test, or preloaded:
 *
 *   LD_PRELOAD=build/release/tests/libpty_as_serial_shim.so pheromoned ...
 *
 * PTY_SHIM_KEY names a FIFO into which a '1' goes when the program raises RTS, a '0' when it lowers
 * it; the UART then has a FIFO of 16 bytes, whose bits take their time.
 *
 * A test that is linked with it may play the modem and the driver (pty_as_serial_shim.h).
 *
 * Everything else goes to the system as it is. */
#define _GNU_SOURCE
#include "server/robots/links/testing/pty_as_serial_shim.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t released = PTHREAD_COND_INITIALIZER;
static int hangs;
static int held;
static int slow_ms;
static int calls;
static int inputs;
static int outputs;
static int has_counts;
static struct PtyShimCounts counts;
static struct PtyShimRs485 rs485;
static struct PtyShimUart uart;
static struct PtyShimSent sent;
static int asked;
static int key_fd = -1;
static long long byte_ns;
static long long busy_until_ns; /* the end of the last bit given to the UART */
static int stopped;
static long long stopped_at_ns;
static long long stopped_for_ns;

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

void PtyShimSlow(int ms) {
  pthread_mutex_lock(&lock);
  slow_ms = ms;
  pthread_mutex_unlock(&lock);
}

int PtyShimCalls(void) {
  pthread_mutex_lock(&lock);
  const int now = calls;
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

/* The UART's clock; under the lock. */
static long long UartNow(void) {
  struct timespec now;
  if (stopped) {
    return stopped_at_ns;
  }
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1000000000LL + now.tv_nsec - stopped_for_ns;
}

void PtyShimSetUart(struct PtyShimUart now) {
  pthread_mutex_lock(&lock);
  uart = now;
  memset(&sent, 0, sizeof sent);
  asked = 0;
  stopped = 0;
  stopped_for_ns = 0;
  busy_until_ns = 0;
  pthread_mutex_unlock(&lock);
}

void PtyShimStopUart(int stop) {
  pthread_mutex_lock(&lock);
  const long long now = UartNow();
  if (stop && !stopped) {
    stopped_at_ns = now;
    stopped = 1;
  } else if (!stop && stopped) {
    stopped = 0;
    stopped_for_ns = 0;
    stopped_for_ns = UartNow() - stopped_at_ns;
  }
  pthread_mutex_unlock(&lock);
}

struct PtyShimSent PtyShimAir(void) {
  pthread_mutex_lock(&lock);
  const struct PtyShimSent now = sent;
  pthread_mutex_unlock(&lock);
  return now;
}

int PtyShimAsked(void) {
  pthread_mutex_lock(&lock);
  const int now = asked;
  pthread_mutex_unlock(&lock);
  return now;
}

/* Bytes that have not left yet, the one in the shift register included; under the lock. */
static long long Unsent(void) {
  const long long left_ns = busy_until_ns - UartNow();
  return left_ns > 0 ? (left_ns + byte_ns - 1) / byte_ns : 0;
}

/* Of these, in the driver's buffer. */
static long long Buffered(void) {
  const long long unsent = Unsent();
  return unsent > uart.fifo + 1 ? unsent - uart.fifo - 1 : 0;
}

/* A port that a program has opened for itself: neither a master nor the terminal of the test. */
static int IsPort(int descriptor) {
  int value = 0;
  return syscall(SYS_ioctl, descriptor, TIOCGEXCL, &value) == 0 && value != 0 &&
         syscall(SYS_ioctl, descriptor, TIOCGPTN, &value) != 0;
}

static int BaudOf(speed_t speed) {
  static const struct {
    speed_t speed;
    int baud;
  } kRates[] = {{B1200, 1200},   {B2400, 2400},   {B4800, 4800},   {B9600, 9600},
                {B19200, 19200}, {B38400, 38400}, {B57600, 57600}, {B115200, 115200}};
  for (size_t i = 0; i < sizeof kRates / sizeof *kRates; ++i) {
    if (kRates[i].speed == speed) {
      return kRates[i].baud;
    }
  }
  fprintf(stderr, "pty_as_serial_shim: no UART for this baud rate\n");
  abort();
}

static void Transmit(int descriptor, ssize_t size) {
  struct termios mode;
  pthread_mutex_lock(&lock);
  if (uart.fifo != 0 && size > 0 && IsPort(descriptor) && tcgetattr(descriptor, &mode) == 0) {
    const long long now = UartNow();
    byte_ns = 10000000000LL / BaudOf(cfgetospeed(&mode));
    busy_until_ns = (busy_until_ns > now ? busy_until_ns : now) + size * byte_ns;
    sent.bytes += size;
    sent.cut += uart.key_line == 0 || (outputs & uart.key_line) != 0 ? 0 : size;
  }
  pthread_mutex_unlock(&lock);
}

ssize_t write(int descriptor, const void* bytes, size_t size) {
  const ssize_t written = (ssize_t)syscall(SYS_write, descriptor, bytes, size);
  const int error = errno;
  Transmit(descriptor, written);
  errno = error;
  return written;
}

ssize_t writev(int descriptor, const struct iovec* parts, int count) {
  const ssize_t written = (ssize_t)syscall(SYS_writev, descriptor, parts, count);
  const int error = errno;
  Transmit(descriptor, written);
  errno = error;
  return written;
}

int tcdrain(int descriptor) {
  const struct timespec pause = {0, 100000};
  int waits = 1;
  if (uart.fifo == 0 || !IsPort(descriptor)) {
    return (int)syscall(SYS_ioctl, descriptor, TCSBRK, 1);
  }
  while (1) {
    pthread_mutex_lock(&lock);
    waits = (uart.drains_early ? Buffered() : Unsent()) != 0;
    pthread_mutex_unlock(&lock);
    if (!waits) {
      return 0;
    }
    nanosleep(&pause, NULL);
  }
}

/* What is in the driver's buffer does not leave any more. */
int tcflush(int descriptor, int queue) {
  if (queue != TCIFLUSH && IsPort(descriptor)) {
    pthread_mutex_lock(&lock);
    const long long buffered = uart.fifo != 0 ? Buffered() : 0;
    sent.cut += buffered;
    busy_until_ns -= buffered * byte_ns;
    pthread_mutex_unlock(&lock);
  }
  return (int)syscall(SYS_ioctl, descriptor, TCFLSH, queue);
}

__attribute__((constructor)) static void OpenKey(void) {
  const char* const path = getenv("PTY_SHIM_KEY");
  if (path != NULL) {
    key_fd = open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    uart = (struct PtyShimUart){.fifo = 16, .key_line = TIOCM_RTS, .has_lsr = 1};
  }
}

/* The program changes the lines; under the lock. */
static void SetOutputs(int lines) {
  if (key_fd >= 0 && ((outputs ^ lines) & TIOCM_RTS) != 0) {
    const ssize_t written = (ssize_t)syscall(SYS_write, key_fd, lines & TIOCM_RTS ? "1" : "0", 1);
    (void)written;
  }
  if (uart.fifo != 0 && (outputs & uart.key_line) != 0 && (lines & uart.key_line) == 0) {
    const long long unsent = Unsent();
    sent.cut += unsent;
    sent.tail_ns = UartNow() - busy_until_ns;
  }
  outputs = lines;
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
    if (slow_ms != 0) {
      const struct timespec pause = {0, slow_ms * 1000000L};
      pthread_mutex_unlock(&lock);
      nanosleep(&pause, NULL);
      pthread_mutex_lock(&lock);
    }
    --held;
    ++calls;
  }
  if (request == TIOCMGET) {
    *(int*)argument = inputs | outputs;
  } else if (request == TIOCMSET) {
    SetOutputs(*(const int*)argument);
  } else if (request == TIOCMBIS) {
    SetOutputs(outputs | *(const int*)argument);
  } else if (request == TIOCMBIC) {
    SetOutputs(outputs & ~*(const int*)argument);
  } else if (request == TIOCOUTQ) {
    ++asked;
    *(int*)argument = (int)Buffered();
  } else if (request == TIOCSERGETLSR && uart.fifo != 0 && uart.has_lsr) {
    ++asked;
    *(unsigned*)argument = Unsent() == 0 ? TIOCSER_TEMT : 0;
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
  /* A pseudo-terminal knows no bytes that are still to be sent. */
  const int asks_uart = request == TIOCOUTQ && uart.fifo != 0 && IsPort(descriptor);
  long result = asks_uart ? -1 : syscall(SYS_ioctl, descriptor, request, argument);
  int error = asks_uart ? ENOTTY : errno;
  if (result == -1 && (error == ENOTTY || error == EINVAL) && isatty(descriptor)) {
    pthread_mutex_lock(&lock);
    error = Fake(request, argument);
    pthread_mutex_unlock(&lock);
    result = error == 0 ? 0 : -1;
  }
  errno = error;
  return (int)result;
}
