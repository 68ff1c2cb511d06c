#include "server/formats/maps/png_picture.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <csetjmp>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "server/base/file.h"
#include "server/base/message.h"

// libpng reports errors by longjmp. So each function that calls setjmp, and every one between it
// and libpng, has only plain local variables; objects that own memory belong to their caller.

namespace pheromone::maps {

namespace {

constexpr size_t kMaxChunkBytes = size_t{1} << 20;  // of what is not pixels: text, profiles
constexpr int kMaxChunksKept = 16;
constexpr size_t kMaxExpansion = 1032;  // deflate's best: 258 bytes from 2 bits

struct Failure {
  std::array<char, 128> text{};
};

void OnError(png_structp png, png_const_charp text) {
  auto* const failure = static_cast<Failure*>(png_get_error_ptr(png));
  std::strncpy(failure->text.data(), text, failure->text.size() - 1);
  png_longjmp(png, 1);
}

void OnWarning(png_structp /*png*/, png_const_charp /*text*/) {}

// The input, and the position in it.
struct Reader {
  explicit Reader(std::string_view input)
      : bytes(input),
        png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, OnError, OnWarning)) {
    info = png != nullptr ? png_create_info_struct(png) : nullptr;
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }

  std::string_view bytes;
  size_t at = 0;
  Failure failure;
  png_structp png;
  png_infop info = nullptr;
  uint32_t columns = 0;
  uint32_t rows = 0;
  int depth = 0;
  int channels = 0;
  int passes = 1;
  size_t row_bytes = 0;
};

void OnRead(png_structp png, png_bytep to, size_t count) {
  auto* const reader = static_cast<Reader*>(png_get_io_ptr(png));
  if (count > reader->bytes.size() - reader->at) {
    png_error(png, "the file ends too early");
  }
  std::memcpy(to, reader->bytes.data() + reader->at, count);
  reader->at += count;
}

// Everything up to the pixels. Rows will be gray or RGB with or without alpha, 8 or 16 bits.
bool ReadHeader(Reader* reader) {
  if (setjmp(png_jmpbuf(reader->png)) != 0) {
    return false;
  }
  png_structp png = reader->png;
  png_set_read_fn(png, reader, OnRead);
  png_set_user_limits(png, kMaxSide, kMaxSide);
  png_set_chunk_malloc_max(png, kMaxChunkBytes);
  png_set_chunk_cache_max(png, kMaxChunksKept);
  png_read_info(png, reader->info);
  reader->columns = png_get_image_width(png, reader->info);
  reader->rows = png_get_image_height(png, reader->info);
  png_set_expand(png);
  reader->passes = png_set_interlace_handling(png);
  png_read_update_info(png, reader->info);
  reader->depth = png_get_bit_depth(png, reader->info);
  reader->channels = png_get_channels(png, reader->info);
  reader->row_bytes = png_get_rowbytes(png, reader->info);
  return true;
}

bool ReadRow(Reader* reader, uint8_t* row) {
  if (setjmp(png_jmpbuf(reader->png)) != 0) {
    return false;
  }
  png_read_row(reader->png, row, nullptr);
  return true;
}

bool ReadEnd(Reader* reader) {
  if (setjmp(png_jmpbuf(reader->png)) != 0) {
    return false;
  }
  png_read_end(reader->png, nullptr);
  return true;
}

// The values of a row: the mean of each pixel's colours, NaN if it is not opaque.
void TakeRow(const Reader& reader, const uint8_t* bytes, double* values) {
  const bool wide = reader.depth == 16;
  const double opaque = wide ? 65535 : 255;
  const size_t colours = reader.channels >= 3 ? 3 : 1;
  const bool has_alpha = static_cast<size_t>(reader.channels) > colours;
  std::array<double, 4> pixel{};
  for (uint32_t column = 0; column < reader.columns; ++column) {
    for (size_t i = 0; i < static_cast<size_t>(reader.channels); ++i) {
      pixel[i] = wide ? bytes[0] << 8 | bytes[1] : bytes[0];
      bytes += wide ? 2 : 1;
    }
    const double mean = colours == 1 ? pixel[0] : (pixel[0] + pixel[1] + pixel[2]) / 3;
    const bool known = !has_alpha || pixel[colours] == opaque;
    values[column] = known ? mean : std::numeric_limits<double>::quiet_NaN();
  }
}

bool ReadPixels(Reader* reader, Raster* raster) {
  // In an interlaced image, no row is complete before the last pass.
  const bool whole = reader->passes > 1;
  std::vector<uint8_t> pixels(reader->row_bytes * (whole ? reader->rows : 1));
  for (int pass = 1; pass <= reader->passes; ++pass) {
    for (uint32_t i = 0; i < reader->rows; ++i) {
      uint8_t* const row = pixels.data() + (whole ? i * reader->row_bytes : 0);
      if (!ReadRow(reader, row)) {
        return false;
      }
      if (pass == reader->passes) {
        TakeRow(*reader, row, &raster->At(0, raster->rows - 1 - static_cast<int32_t>(i)));
      }
    }
  }
  return ReadEnd(reader);
}

// Of what is written, rows of `row_bytes` from the top down.
struct Writer {
  explicit Writer(std::string* output)
      : to(output),
        png(png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, OnError, OnWarning)) {
    info = png != nullptr ? png_create_info_struct(png) : nullptr;
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { png_destroy_write_struct(&png, &info); }

  std::string* to;
  Failure failure;
  png_structp png;
  png_infop info = nullptr;
};

void OnWrite(png_structp png, png_bytep from, size_t count) {
  static_cast<Writer*>(png_get_io_ptr(png))->to->append(reinterpret_cast<const char*>(from), count);
}

void OnFlush(png_structp /*png*/) {}

bool WriteHeader(Writer* writer, uint32_t columns, uint32_t rows, int depth, int colour_type) {
  if (setjmp(png_jmpbuf(writer->png)) != 0) {
    return false;
  }
  png_set_write_fn(writer->png, writer, OnWrite, OnFlush);
  png_set_user_limits(writer->png, kMaxSide, kMaxSide);
  png_set_IHDR(writer->png, writer->info, columns, rows, depth, colour_type, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer->png, writer->info);
  return true;
}

bool WriteRow(Writer* writer, const uint8_t* row) {
  if (setjmp(png_jmpbuf(writer->png)) != 0) {
    return false;
  }
  png_write_row(writer->png, row);
  return true;
}

bool WriteEnd(Writer* writer) {
  if (setjmp(png_jmpbuf(writer->png)) != 0) {
    return false;
  }
  png_write_end(writer->png, nullptr);
  return true;
}

// `fill(i, row)` gives the bytes of row i from the top.
template <typename Fill>
Result<std::string> Encode(uint32_t columns, uint32_t rows, int depth, int colour_type,
                           const Fill& fill) {
  std::string bytes;
  Writer writer(&bytes);
  bool done = writer.info != nullptr && WriteHeader(&writer, columns, rows, depth, colour_type);
  std::vector<uint8_t> row;
  for (uint32_t i = 0; done && i < rows; ++i) {
    row.clear();
    fill(static_cast<int32_t>(i), &row);
    done = WriteRow(&writer, row.data());
  }
  if (!done || !WriteEnd(&writer)) {
    return Error{std::string("libpng: ") + writer.failure.text.data()};
  }
  return bytes;
}

Status Save(const std::string& path, const Result<std::string>& bytes) {
  return bytes.ok() ? WriteFile(path, bytes.value()) : Error{path + ": " + bytes.error()};
}

// libpng allocates memory for the declared length of a chunk: a file of 89 bytes could cost a
// gigabyte. So no chunk may be longer than the file. Returns the position of such a chunk; empty if
// there is none.
std::optional<size_t> FindOverlongChunk(std::string_view bytes) {
  constexpr size_t kAround = 12;  // its length and kind before the data, its CRC after
  for (size_t at = 8; at + kAround <= bytes.size();) {
    size_t length = 0;
    for (size_t i = 0; i < 4; ++i) {
      length = length << 8 | static_cast<uint8_t>(bytes[at + i]);
    }
    if (length > bytes.size() - at - kAround) {
      return at;
    }
    at += kAround + length;
  }
  return std::nullopt;
}

}  // namespace

Result<GrayImage> ParsePng(std::string_view bytes, std::string_view name) {
  if (png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0,
                  std::min<size_t>(bytes.size(), 8)) != 0) {
    return AtByte(name, 0, "found " + Quoted(bytes.substr(0, 8)) + ", expected a PNG's signature");
  }
  if (const std::optional<size_t> at = FindOverlongChunk(bytes)) {
    return AtByte(name, *at, "found a chunk that extends beyond the end of the file");
  }
  Reader reader(bytes);
  if (reader.info == nullptr || !ReadHeader(&reader)) {
    return AtByte(name, reader.at, reader.failure.text.data());
  }
  const std::string problem = SizeProblem(reader.columns, reader.rows);
  if (!problem.empty()) {
    return AtByte(name, reader.at, problem);
  }
  // A pixel needs at least one bit: an image too large for the length of the file is not allocated.
  if (uint64_t{reader.columns} * reader.rows / 8 > bytes.size() * kMaxExpansion) {
    return AtByte(name, bytes.size(), "the file ends too early");
  }
  GrayImage image{
      MakeRaster(static_cast<int32_t>(reader.columns), static_cast<int32_t>(reader.rows)),
      static_cast<uint16_t>(reader.depth == 16 ? 65535 : 255)};
  if (!ReadPixels(&reader, &image.raster)) {
    return AtByte(name, reader.at, reader.failure.text.data());
  }
  return image;
}

Result<GrayImage> LoadPng(const std::string& path) {
  const Result<std::string> bytes = ReadFile(path);
  return bytes.ok() ? ParsePng(bytes.value(), path) : bytes.error();
}

Result<std::string> EncodeGrayPng(const GrayImage& image) {
  const bool wide = image.maximum > 255;
  const uint16_t white = wide ? 65535 : 255;
  const Raster& raster = image.raster;
  return Encode(static_cast<uint32_t>(raster.columns), static_cast<uint32_t>(raster.rows),
                wide ? 16 : 8, PNG_COLOR_TYPE_GRAY, [&](int32_t i, std::vector<uint8_t>* row) {
                  for (int32_t column = 0; column < raster.columns; ++column) {
                    const double value = raster.At(column, raster.rows - 1 - i);
                    const uint16_t level = NearestLevel(value / image.maximum * white, white);
                    if (wide) {
                      row->push_back(static_cast<uint8_t>(level >> 8));
                    }
                    row->push_back(static_cast<uint8_t>(level & 0xFF));
                  }
                });
}

Status SaveGrayPng(const std::string& path, const GrayImage& image) {
  return Save(path, EncodeGrayPng(image));
}

Result<std::string> EncodePicture(const Raster& raster, const PictureStyle& style) {
  assert(style.high > style.low && style.pixels_per_cell >= 1);
  const auto enlarged = static_cast<uint64_t>(style.pixels_per_cell);
  const uint64_t columns = static_cast<uint64_t>(raster.columns) * enlarged;
  const uint64_t rows = static_cast<uint64_t>(raster.rows) * enlarged;
  const std::string problem = SizeProblem(columns, rows);
  if (!problem.empty()) {
    return Error{"picture: " + problem};
  }
  return Encode(static_cast<uint32_t>(columns), static_cast<uint32_t>(rows), 8, PNG_COLOR_TYPE_RGB,
                [&](int32_t i, std::vector<uint8_t>* row) {
                  const int32_t cell_row = raster.rows - 1 - i / style.pixels_per_cell;
                  for (int32_t column = 0; column < raster.columns; ++column) {
                    const double value = raster.At(column, cell_row);
                    const double share = (value - style.low) / (style.high - style.low);
                    const Rgb colour = std::isnan(value)                     ? style.unknown
                                       : std::isinf(value) && style.infinite ? *style.infinite
                                                                             : Viridis(share);
                    for (int n = 0; n < style.pixels_per_cell; ++n) {
                      row->insert(row->end(), {colour.red, colour.green, colour.blue});
                    }
                  }
                });
}

Status SavePicture(const std::string& path, const Raster& raster, const PictureStyle& style) {
  return Save(path, EncodePicture(raster, style));
}

}  // namespace pheromone::maps
