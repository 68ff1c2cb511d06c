#include "client_fw/tracker/picture.h"

#include <jerror.h>
#include <jpeglib.h>

#include <array>
#include <csetjmp>
#include <cstdio>

#include "server/base/file.h"
#include "server/formats/maps/pgm.h"
#include "server/formats/maps/png_picture.h"

namespace pheromone::tracker {
namespace {

constexpr int64_t kMaxPixels = 100'000'000;

// libjpeg reports errors by a function that must not return: it jumps. So the functions that call
// setjmp, and those between them and libjpeg, have only plain local variables.
struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf back;
  std::array<char, JMSG_LENGTH_MAX> text;
};

void OnJpegError(j_common_ptr common) {
  auto* const errors = reinterpret_cast<JpegErrors*>(common->err);
  common->err->format_message(common, errors->text.data());
  std::longjmp(errors->back, 1);
}

// A warning is damaged data: a picture with gray instead of tags. But many cameras send some bytes
// after the last one of a picture, which do no harm.
void OnJpegMessage(j_common_ptr common, int level) {
  if (level < 0 && common->err->msg_code != JWRN_EXTRANEOUS_DATA) {
    OnJpegError(common);
  }
}

struct JpegReader {
  JpegReader() {
    jpeg.err = jpeg_std_error(&errors.manager);
    errors.manager.error_exit = OnJpegError;
    errors.manager.emit_message = OnJpegMessage;
    errors.text.front() = '\0';
    jpeg_create_decompress(&jpeg);
  }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
  ~JpegReader() { jpeg_destroy_decompress(&jpeg); }

  jpeg_decompress_struct jpeg{};
  JpegErrors errors{};
};

bool BeginJpeg(JpegReader* reader, std::string_view bytes) {
  if (setjmp(reader->errors.back) != 0) {
    return false;
  }
  jpeg_mem_src(&reader->jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&reader->jpeg, TRUE);
  reader->jpeg.out_color_space = JCS_GRAYSCALE;
  return true;
}

bool ReadJpeg(JpegReader* reader, Picture* picture) {
  if (setjmp(reader->errors.back) != 0) {
    return false;
  }
  jpeg_start_decompress(&reader->jpeg);
  while (reader->jpeg.output_scanline < reader->jpeg.output_height) {
    JSAMPROW row = picture->levels.data() +
                   picture->IndexOf(0, static_cast<int>(reader->jpeg.output_scanline));
    jpeg_read_scanlines(&reader->jpeg, &row, 1);
  }
  jpeg_finish_decompress(&reader->jpeg);
  return true;
}

Result<Picture> ParseJpeg(std::string_view bytes, std::string_view name) {
  JpegReader reader;
  Picture picture;
  if (BeginJpeg(&reader, bytes)) {
    if (int64_t{reader.jpeg.image_width} * reader.jpeg.image_height > kMaxPixels) {
      return Error{std::string(name) + ": found more than 100 megapixels"};
    }
    picture = MakePicture(static_cast<int>(reader.jpeg.image_width),
                          static_cast<int>(reader.jpeg.image_height));
    if (ReadJpeg(&reader, &picture)) {
      return picture;
    }
  }
  return Error{std::string(name) + ": JPEG: " + reader.errors.text.data()};
}

Result<Picture> FromMap(Result<maps::GrayImage> image) {
  if (!image.ok()) {
    return image.error();
  }
  const maps::Raster& raster = image.value().raster;
  Picture picture = MakePicture(raster.columns, raster.rows);
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      const double level = raster.At(column, raster.rows - 1 - row);
      picture.levels[picture.IndexOf(column, row)] =
          static_cast<uint8_t>(maps::NearestLevel(level * 255 / image.value().maximum, 255));
    }
  }
  return picture;
}

}  // namespace

Picture MakePicture(int width, int height) {
  Picture picture{width, height, {}};
  picture.levels.resize(picture.IndexOf(0, height));
  return picture;
}

Result<Picture> LoadPicture(const std::string& path) {
  PHEROMONE_TRY(const std::string bytes, ReadFile(path));
  return ParsePicture(bytes, path);
}

Result<Picture> ParsePicture(std::string_view bytes, std::string_view name) {
  if (bytes.starts_with("\xFF\xD8")) {
    return ParseJpeg(bytes, name);
  }
  if (bytes.starts_with("\x89PNG")) {
    return FromMap(maps::ParsePng(bytes, name));
  }
  if (bytes.starts_with("P5") || bytes.starts_with("P2")) {
    return FromMap(maps::ParsePgm(bytes, name));
  }
  return Error{std::string(name) + ": found no picture, expected PNG, JPEG or PGM"};
}

Result<Picture> PictureOfYuyv(std::string_view bytes, int width, int height, size_t stride) {
  Picture picture = MakePicture(width, height);
  const auto row_bytes = 2 * static_cast<size_t>(width);
  if (stride < row_bytes || bytes.size() < stride * static_cast<size_t>(height - 1) + row_bytes) {
    return Error{"the camera delivered " + std::to_string(bytes.size()) +
                 " bytes, expected a picture of " + std::to_string(width) + " x " +
                 std::to_string(height) + " in YUYV"};
  }
  for (int row = 0; row < height; ++row) {
    const std::string_view from = bytes.substr(stride * static_cast<size_t>(row), row_bytes);
    for (int column = 0; column < width; ++column) {
      picture.levels[picture.IndexOf(column, row)] =
          static_cast<uint8_t>(from[2 * static_cast<size_t>(column)]);
    }
  }
  return picture;
}

Result<std::string> EncodePng(const Picture& picture) {
  maps::GrayImage image{maps::MakeRaster(picture.width, picture.height), 255};
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      image.raster.At(column, picture.height - 1 - row) =
          picture.levels[picture.IndexOf(column, row)];
    }
  }
  return maps::EncodeGrayPng(image);
}

}  // namespace pheromone::tracker
