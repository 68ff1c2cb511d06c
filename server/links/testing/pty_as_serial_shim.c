/* Lets libserialport open a pseudo-terminal, for tests on machines without serial ports. It looks a
 * port up in sysfs and asks for its modem lines, and a pseudo-terminal has neither: here, one that
 * exists has an entry, and lines that are all off. Linked into a test, or preloaded:
 *
 *   LD_PRELOAD=build/release/tests/libpty_as_serial_shim.so pheromoned ...
 *
 * Everything else goes to the system as it is. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

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

int ioctl(int descriptor, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  const long result = syscall(SYS_ioctl, descriptor, request, argument);
  if (result == -1 && isatty(descriptor)) {
    if (request == TIOCMGET) {
      *(int*)argument = 0;
      return 0;
    }
    if (request == TIOCMSET || request == TIOCMBIS || request == TIOCMBIC) {
      return 0;
    }
  }
  return (int)result;
}
