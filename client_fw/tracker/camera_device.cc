#include "client_fw/tracker/camera_device.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

namespace pheromone::tracker {
namespace {

constexpr uint32_t kBuffers = 4;
constexpr int kSilenceMs = 2000;

int Control(const Descriptor& descriptor, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ioctl(descriptor.get(), request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

v4l2_buffer BufferOf(uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

Error Failed(const std::string& path, const std::string& what) {
  return Error{path + ": " + what + ": " + std::generic_category().message(errno)};
}

}  // namespace

Result<CameraDevice> CameraDevice::Open(const std::string& path, int width, int height) {
  CameraDevice camera;
  camera.path_ = path;
  camera.descriptor_ = Descriptor(open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!camera.descriptor_.valid()) {
    return Failed(path, "cannot be opened");
  }
  v4l2_capability capability{};
  if (Control(camera.descriptor_, VIDIOC_QUERYCAP, &capability) < 0) {
    return Failed(path, "is no camera");
  }
  const uint32_t has = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                           ? capability.device_caps
                           : capability.capabilities;
  if ((has & V4L2_CAP_VIDEO_CAPTURE) == 0 || (has & V4L2_CAP_STREAMING) == 0) {
    return Error{path +
                 ": is no camera that streams pictures; it has perhaps another number, see "
                 "v4l2-ctl --list-devices"};
  }
  PHEROMONE_TRY_STATUS(camera.SetFormat(width, height));
  PHEROMONE_TRY_STATUS(camera.Start());
  return camera;
}

CameraDevice::~CameraDevice() {
  if (descriptor_.valid()) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    Control(descriptor_, VIDIOC_STREAMOFF, &type);
  }
  for (const Mapped& it : mapped_) {
    munmap(it.at, it.size);
  }
}

Status CameraDevice::SetFormat(int width, int height) {
  std::string found;
  for (const uint32_t kind : {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG}) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<uint32_t>(width);
    format.fmt.pix.height = static_cast<uint32_t>(height);
    format.fmt.pix.pixelformat = kind;
    format.fmt.pix.field = V4L2_FIELD_ANY;
    if (Control(descriptor_, VIDIOC_S_FMT, &format) < 0) {
      return Failed(path_, "the picture's format cannot be set");
    }
    // The driver answers with what it does instead.
    const v4l2_pix_format& pix = format.fmt.pix;
    found = std::to_string(pix.width) + " x " + std::to_string(pix.height);
    if (pix.pixelformat == kind && pix.width == static_cast<uint32_t>(width) &&
        pix.height == static_cast<uint32_t>(height)) {
      jpeg_ = kind == V4L2_PIX_FMT_MJPEG;
      width_ = width;
      height_ = height;
      stride_ = pix.bytesperline;
      return Ok();
    }
  }
  return Error{path_ + ": offers " + found + ", expected " + std::to_string(width) + " x " +
               std::to_string(height) +
               " in YUYV or MJPEG: v4l2-ctl --list-formats-ext lists what "
               "it can"};
}

Status CameraDevice::Start() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (Control(descriptor_, VIDIOC_REQBUFS, &request) < 0) {
    return Failed(path_, errno == EBUSY ? "another program has it" : "has no buffers");
  }
  for (uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = BufferOf(i);
    if (Control(descriptor_, VIDIOC_QUERYBUF, &buffer) < 0) {
      return Failed(path_, "a buffer");
    }
    void* const at = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED,
                          descriptor_.get(), static_cast<off_t>(buffer.m.offset));
    if (at == MAP_FAILED) {
      return Failed(path_, "a buffer");
    }
    mapped_.push_back({at, buffer.length});
    if (Control(descriptor_, VIDIOC_QBUF, &buffer) < 0) {
      return Failed(path_, "a buffer");
    }
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (Control(descriptor_, VIDIOC_STREAMON, &type) < 0) {
    return Failed(path_, "does not start");
  }
  return Ok();
}

Result<Picture> CameraDevice::Decode(size_t buffer, size_t size) const {
  const std::string_view bytes(static_cast<const char*>(mapped_[buffer].at),
                               std::min(size, mapped_[buffer].size));
  if (!jpeg_) {
    return PictureOfYuyv(bytes, width_, height_, stride_);
  }
  PHEROMONE_TRY(Picture picture, ParsePicture(bytes, path_));
  if (picture.width != width_ || picture.height != height_) {
    return Error{path_ + ": delivered a picture of another size"};
  }
  return picture;
}

Result<Picture> CameraDevice::Next() {
  constexpr int kMaxDamaged = 100;
  std::string damage;
  for (int damaged = 0; damaged < kMaxDamaged; ++damaged) {
    pollfd waiting = {descriptor_.get(), POLLIN, 0};
    const int ready = poll(&waiting, 1, kSilenceMs);
    if (ready < 0 && errno != EINTR) {
      return Failed(path_, "cannot be waited for");
    }
    if (ready == 0) {
      return Error{path_ + ": no picture for 2 s" + (damage.empty() ? "" : "; " + damage)};
    }
    std::optional<v4l2_buffer> newest;
    v4l2_buffer buffer = BufferOf(0);
    while (Control(descriptor_, VIDIOC_DQBUF, &buffer) >= 0) {
      if (newest && Control(descriptor_, VIDIOC_QBUF, &*newest) < 0) {
        return Failed(path_, "delivers nothing");
      }
      newest = buffer;
      buffer = BufferOf(0);
    }
    if (errno != EAGAIN) {
      return Failed(path_, "delivers nothing");
    }
    if (!newest) {
      continue;
    }
    const bool whole = (newest->flags & V4L2_BUF_FLAG_ERROR) == 0;
    Result<Picture> picture = Decode(newest->index, newest->bytesused);
    if (Control(descriptor_, VIDIOC_QBUF, &*newest) < 0) {
      return Failed(path_, "delivers nothing");
    }
    if (whole && picture.ok()) {
      return picture;
    }
    damage = picture.ok() ? "its pictures are damaged" : std::string(picture.error());
  }
  return Error{path_ + ": " + std::to_string(kMaxDamaged) + " damaged pictures: " + damage};
}

}  // namespace pheromone::tracker
