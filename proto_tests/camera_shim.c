/* Plays a camera of Video4Linux2 for a program that is started with
 *
 *   LD_PRELOAD=build/release/tests/libcamera_shim.so CAMERA=FOLDER pheromone-tracker ...
 *
 * /dev/video0 is then a camera of 1280 x 960. In FOLDER are the frames as they lie in memory:
 * old, of which two wait already, and new, which comes after them and then again and again. The
 * first of these is FOLDER/bad instead, if it is there; if FOLDER/flagged is, too, the driver marks
 * it as damaged. The file FOLDER/kind says what these are, YUYV (rows of 2 * 1280 + 64 bytes) or
 * MJPG; another format that is asked for is answered with that one, as drivers do. While there is
 * FOLDER/gone, the camera is unplugged.
 *
 * Written from the kernel's documentation of the interface ("Video for Linux API"), not from the
 * program. It stands for a well-behaved driver, not for all of them. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

enum { kWidth = 1280, kHeight = 960, kPadding = 64, kBuffers = 4 };
enum { kStride = 2 * kWidth + kPadding, kLength = 4096 * (kStride * kHeight / 4096 + 1) };

static int camera = -1;      /* a file in memory: the buffers, one behind the other */
static int queued[kBuffers]; /* the application has given it back */
static int streaming;
static int delivered; /* frames since the start */
static int waiting;   /* that a caller would get before EAGAIN */

static size_t Read(const char* name, void* to, size_t size) {
  char path[4096];
  snprintf(path, sizeof path, "%s/%s", getenv("CAMERA"), name);
  FILE* file = fopen(path, "rb");
  size_t count = file == NULL ? 0 : fread(to, 1, size, file);
  if (file != NULL) {
    fclose(file);
  }
  return count;
}

static int Exists(const char* name) {
  char byte;
  return Read(name, &byte, 1) == 1;
}

static int Fail(int error) {
  errno = error;
  return -1;
}

static int Open(const char* path, int flags, int mode) {
  if (getenv("CAMERA") != NULL && strcmp(path, "/dev/video0") == 0) {
    camera = memfd_create("camera", 0);
    return ftruncate(camera, (off_t)kBuffers * kLength) == 0 ? camera : -1;
  }
  return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const int mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, int) : 0;
  va_end(more);
  return Open(path, flags, mode);
}

int open64(const char* path, int flags, ...) __attribute__((alias("open")));

static int SetFormat(struct v4l2_pix_format* pix) {
  char kind[5] = "";
  Read("kind", kind, 4);
  pix->width = kWidth;
  pix->height = kHeight;
  pix->pixelformat =
      v4l2_fourcc((unsigned)kind[0], (unsigned)kind[1], (unsigned)kind[2], (unsigned)kind[3]);
  pix->bytesperline = pix->pixelformat == V4L2_PIX_FMT_YUYV ? kStride : 0;
  pix->sizeimage = kLength;
  return 0;
}

static int Dequeue(struct v4l2_buffer* buffer) {
  int index = 0;
  if (!streaming) {
    return Fail(EINVAL);
  }
  while (index < kBuffers && !queued[index]) {
    ++index;
  }
  if (index == kBuffers || waiting == 0) {
    waiting = 1; /* the next one comes meanwhile */
    return Fail(EAGAIN);
  }
  void* at =
      mmap(NULL, kLength, PROT_READ | PROT_WRITE, MAP_SHARED, camera, (off_t)index * kLength);
  const int bad = delivered == 2 && Exists("bad");
  const char* const frame = delivered < 2 ? "old" : bad ? "bad" : "new";
  buffer->bytesused = (unsigned)Read(frame, at, kLength);
  munmap(at, kLength);
  buffer->index = (unsigned)index;
  buffer->flags = V4L2_BUF_FLAG_MAPPED | V4L2_BUF_FLAG_DONE;
  if (bad && Exists("flagged")) {
    buffer->flags |= V4L2_BUF_FLAG_ERROR;
  }
  queued[index] = 0;
  ++delivered;
  --waiting;
  return 0;
}

static int Answer(unsigned long request, void* argument) {
  struct v4l2_buffer* const buffer = argument;
  if (Exists("gone")) {
    return Fail(ENODEV);
  }
  switch (request) {
    case VIDIOC_QUERYCAP: {
      struct v4l2_capability* const has = argument;
      has->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      has->capabilities = has->device_caps | V4L2_CAP_DEVICE_CAPS;
      return 0;
    }
    case VIDIOC_S_FMT:
      return SetFormat(&((struct v4l2_format*)argument)->fmt.pix);
    case VIDIOC_REQBUFS:
      ((struct v4l2_requestbuffers*)argument)->count = kBuffers;
      return 0;
    case VIDIOC_QUERYBUF:
      buffer->length = kLength;
      buffer->m.offset = buffer->index * kLength;
      return 0;
    case VIDIOC_QBUF:
      if (buffer->index >= kBuffers || queued[buffer->index]) {
        return Fail(EINVAL);
      }
      queued[buffer->index] = 1;
      return 0;
    case VIDIOC_DQBUF:
      return Dequeue(buffer);
    case VIDIOC_STREAMON:
      streaming = 1;
      waiting = 3;
      return 0;
    case VIDIOC_STREAMOFF:
      streaming = 0;
      return 0;
    default:
      return Fail(ENOTTY);
  }
}

int ioctl(int descriptor, unsigned long request, ...) {
  va_list more;
  va_start(more, request);
  void* const argument = va_arg(more, void*);
  va_end(more);
  return descriptor == camera && camera >= 0
             ? Answer(request, argument)
             : (int)syscall(SYS_ioctl, descriptor, request, argument);
}
