#include "server/base/standard_output.h"

#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <streambuf>
#include <string>
#include <string_view>

#include "server/base/descriptor.h"
#include "server/base/escape.h"

namespace pheromone {
namespace {

// One of the two streams. Never freed: exit handlers print.
struct Escaping {
  std::FILE* original = nullptr;
  std::FILE* escaped = nullptr;
  int descriptor = -1;
  std::string unfinished = {};  // the start of a character whose rest comes with the next write
};

Escaping* g_out = nullptr;
Escaping* g_err = nullptr;

// Called by the C library with the stream locked. 0: an error, as in errno.
ssize_t WriteEscaped(void* cookie, const char* bytes, size_t size) {
  auto* const stream = static_cast<Escaping*>(cookie);
  const std::string text = stream->unfinished + std::string(bytes, size);
  const size_t complete = text.size() - UnfinishedAtEnd(text);
  stream->unfinished = text.substr(complete);
  const std::string_view whole = std::string_view(text).substr(0, complete);
  return WriteAll(stream->descriptor, EscapeControls(whole)) ? static_cast<ssize_t>(size) : 0;
}

Escaping* Escape(std::FILE** stream, int descriptor, int buffering) {
  auto* const escaping = new Escaping{*stream, nullptr, descriptor};
  std::fflush(*stream);
  escaping->escaped = fopencookie(escaping, "w", {nullptr, WriteEscaped, nullptr, nullptr});
  if (escaping->escaped == nullptr) {
    std::perror("standard output");
    std::abort();
  }
  std::setvbuf(escaping->escaped, nullptr, buffering, BUFSIZ);
  std::setvbuf(escaping->original, nullptr, _IONBF, 0);
  *stream = escaping->escaped;
  return escaping;
}

// Without a buffer of its own: what C and C++ print keeps its order.
class FileBuffer : public std::streambuf {
 public:
  explicit FileBuffer(std::FILE* file) : file_(file) {}

 protected:
  int_type overflow(int_type byte) override {
    return traits_type::eq_int_type(byte, traits_type::eof()) ? traits_type::not_eof(byte)
                                                              : std::putc(byte, file_);
  }
  std::streamsize xsputn(const char* bytes, std::streamsize size) override {
    return static_cast<std::streamsize>(std::fwrite(bytes, 1, static_cast<size_t>(size), file_));
  }
  int sync() override { return std::fflush(file_); }

 private:
  std::FILE* file_;
};

void Redirect(std::ostream* stream, std::FILE* to) {
  stream->flush();
  stream->rdbuf(new FileBuffer(to));  // never freed: exit handlers print
}

}  // namespace

void EscapeStandardOutput() {
  if (g_out != nullptr) {
    return;
  }
  g_out = Escape(&stdout, STDOUT_FILENO, isatty(STDOUT_FILENO) != 0 ? _IOLBF : _IOFBF);
  g_err = Escape(&stderr, STDERR_FILENO, _IONBF);
  Redirect(&std::cout, stdout);
  Redirect(&std::cerr, stderr);
  Redirect(&std::clog, stderr);
}

std::FILE* Unescaped(std::FILE* stream) {
  for (const Escaping* const it : {g_out, g_err}) {
    if (it != nullptr && it->escaped == stream) {
      std::fflush(stream);
      return it->original;
    }
  }
  return stream;
}

}  // namespace pheromone
