/* Plays a disk that is stuck, slow, or full, for a program that is started with
 *
 *   LD_PRELOAD=build/release/tests/libsick_disk_shim.so SICK_DISK=FOLDER pheromoned ...
 *
 * While there is a file FOLDER/stuck, nothing is synced: fsync and fdatasync wait until it has
 * gone. While there is FOLDER/slow, each of these takes 300 ms. While there is FOLDER/full, files
 * take nothing more: ENOSPC, also for what was reserved, as on a file system that copies on write.
 * What is open as standard output or error is spared.
 *
 * Everything else goes to the system as it is. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static int Is(const char* what) {
  const char* folder = getenv("SICK_DISK");
  char path[4096];
  if (folder == NULL) {
    return 0;
  }
  snprintf(path, sizeof path, "%s/%s", folder, what);
  return access(path, F_OK) == 0;
}

static void WaitWhileStuck(void) {
  const struct timespec moment = {0, 1000000};
  const struct timespec slow = {0, 300000000};
  if (Is("slow")) {
    nanosleep(&slow, NULL);
  }
  while (Is("stuck")) {
    nanosleep(&moment, NULL);
  }
}

static int IsFull(int descriptor) {
  struct stat status;
  return descriptor > STDERR_FILENO && fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
         Is("full");
}

static int Fail(int error) {
  errno = error;
  return -1;
}

int fsync(int descriptor) {
  WaitWhileStuck();
  return (int)syscall(SYS_fsync, descriptor);
}

int fdatasync(int descriptor) {
  WaitWhileStuck();
  return (int)syscall(SYS_fdatasync, descriptor);
}

int fallocate(int descriptor, int mode, off_t offset, off_t length) {
  return IsFull(descriptor) ? Fail(ENOSPC)
                            : (int)syscall(SYS_fallocate, descriptor, mode, offset, length);
}

ssize_t write(int descriptor, const void* bytes, size_t size) {
  return IsFull(descriptor) ? Fail(ENOSPC) : syscall(SYS_write, descriptor, bytes, size);
}

ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t offset) {
  return IsFull(descriptor) ? Fail(ENOSPC) : syscall(SYS_pwrite64, descriptor, bytes, size, offset);
}
