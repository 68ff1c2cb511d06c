// [control] and [web]: how pheromonectl, browsers and Prometheus reach the server.
#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/base/text.h"
#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr size_t kMaxPath = 107;  // of a Unix socket
constexpr size_t kLeastToken = 16;
constexpr size_t kMaxToken = 256;
constexpr const char* kTlsCertificate = "tls_certificate";
constexpr const char* kTlsKey = "tls_key";
constexpr size_t kMaxPem = size_t{64} << 10;
constexpr size_t kMaxNames = 64;
constexpr int64_t kMaxViewers = 48;  // of 64 connections, so that requests have some
constexpr size_t kMaxName = 253;     // of a host, by RFC 1035

// Of a file with a secret.
void WarnIfAllUsersCanReadIt(const TableReader& table, const char* key, const std::string& path,
                             Notes* notes) {
  if (const std::string why = WhyNotSecret(path); !why.empty()) {
    Warn(table, key, why, notes);
  }
}

void ReadToken(const TableReader& table, Notes* notes, WebSettings* web) {
  if (table.Find("token_file") == nullptr) {
    return;
  }
  const auto name = table.String("token_file");
  if (!name || !notes->folder) {  // what was not read from a file is not for a server
    return;
  }
  const std::filesystem::path path = *notes->folder / *name;
  web->token_file = path.string();
  std::error_code error;
  if (!std::filesystem::exists(path, error) &&
      std::filesystem::is_directory(path.has_parent_path() ? path.parent_path() : ".", error)) {
    return;  // the server makes it
  }
  const auto file = ReadNamedFile(table, "token_file", 4096, *notes);
  if (!file) {
    return;
  }
  web->token = Trim(file->text, " \t\r\n");
  const bool printable =
      std::all_of(web->token.begin(), web->token.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (!printable || web->token.size() < kLeastToken || web->token.size() > kMaxToken) {
    table.Report("token_file", file->path +
                                   ": expected 16 to 256 letters, digits and punctuation "
                                   "characters, such as the output of `openssl rand -hex 32`");
    return;
  }
  WarnIfAllUsersCanReadIt(table, "token_file", file->path, notes);
}

// Both files or none: they are checked together.
void ReadTls(const TableReader& table, Notes* notes, WebSettings* web) {
  const bool has_certificate = table.Find(kTlsCertificate) != nullptr;
  const bool has_key = table.Find(kTlsKey) != nullptr;
  if (has_certificate != has_key) {
    table.Missing(has_key ? kTlsCertificate : kTlsKey,
                  has_key ? "the certificate of tls_key, a file in PEM"
                          : "the private key of tls_certificate, a file in PEM");
  }
  const auto chain =
      has_certificate ? ReadNamedFile(table, kTlsCertificate, kMaxPem, *notes) : std::nullopt;
  const auto key = has_key ? ReadNamedFile(table, kTlsKey, kMaxPem, *notes) : std::nullopt;
  if (!chain || !key) {
    return;
  }
  web->tls = Certificate{.chain = chain->text, .key = key->text};
  const CheckedCertificate checked = CheckCertificate(*web->tls);
  if (!checked.chain_error.empty()) {
    table.Report(kTlsCertificate, chain->path + ": " + checked.chain_error);
  }
  if (!checked.key_error.empty()) {
    table.Report(kTlsKey, key->path + ": " + checked.key_error);
  }
  if (!checked.warning.empty()) {
    Warn(table, kTlsCertificate, chain->path + ": " + checked.warning + "; clients will refuse it",
         notes);
  }
  WarnIfAllUsersCanReadIt(table, kTlsKey, key->path, notes);
}

// The texts of a list, each as `read` returns it: empty if it is not as expected.
void ReadNames(const TableReader& table, const char* key, std::string_view expected,
               std::string (*read)(const std::string&), std::vector<std::string>* names) {
  const Value* list = table.Find(key);
  if (list == nullptr) {
    return;
  }
  if (list->kind != Value::Kind::kArray || list->items.size() > kMaxNames) {
    table.Expected(key, *list, expected);
    return;
  }
  for (const Value& item : list->items) {
    std::string name = item.kind == Value::Kind::kString ? read(item.text) : "";
    if (name.empty() || name.size() > kMaxName) {
      table.Expected(key, item, expected);
      continue;
    }
    names->push_back(std::move(name));
  }
}

std::string HostName(const std::string& text) {
  std::string name = ToLower(text);
  constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyz0123456789-_.";
  return name.find_first_not_of(kAllowed) == std::string::npos ? name : "";
}

// As browsers send them: scheme and host, and a port unless it is the usual one; of pages from
// files one of these two.
std::string Origin(const std::string& text) {
  if (text == "null" || text == "file://") {
    return text;
  }
  const size_t host = text.starts_with("https://") ? 8 : text.starts_with("http://") ? 7 : 0;
  const bool is_origin =
      host != 0 && host != text.size() && text.find_first_of("/ *", host) == std::string::npos;
  return is_origin ? text : "";
}

}  // namespace

void ReadControl(const Value& root, Notes* notes, ControlSettings* control) {
  const TableReader table(TableOf(root, "control", notes), "control", &notes->problems);
  table.AllowOnly({"enabled", "socket"});
  const bool enabled = table.Boolean("enabled", true).value_or(true);
  const auto socket = table.String("socket", control->socket);
  if (socket && socket->size() > kMaxPath) {
    table.Expected("socket", *table.Find("socket"),
                   "a path of at most " + std::to_string(kMaxPath) + " bytes");
  }
  control->socket = enabled ? socket.value_or("") : "";
}

void ReadWeb(const Value& root, Notes* notes, WebSettings* web) {
  const TableReader table(TableOf(root, "web", notes), "web", &notes->problems);
  table.AllowOnly({"listen", "token_file", "hosts", "origins", "max_viewers", "ros_distro",
                   "click_pheromone", kTlsCertificate, kTlsKey});
  if (table.Find("listen") != nullptr) {
    const auto endpoint = ReadEndpoint(table, "listen");
    web->listen = endpoint.value_or(Endpoint{});
  }
  ReadToken(table, notes, web);
  ReadTls(table, notes, web);
  const bool is_for_others = !web->listen.address.empty() && web->listen.address != "::1" &&
                             !web->listen.address.starts_with("127.");
  if (is_for_others && !web->tls && table.Find("listen") != nullptr) {
    Warn(table, "listen",
         "the token, and all that is shown, can be read on the way to " + ToText(web->listen) +
             ", expected tls_certificate and tls_key, or 127.0.0.1 and an HTTPS proxy before it",
         notes);
  }
  ReadNames(table, "hosts", "host names without a port, such as [\"lab.local\", \"robots\"]",
            HostName, &web->hosts);
  ReadNames(table, "origins",
            "origins of web pages, such as [\"https://app.foxglove.dev\"]; \"null\" and "
            "\"file://\" for pages from files",
            Origin, &web->origins);
  web->max_viewers = static_cast<uint32_t>(
      table.Integer("max_viewers", 0, kMaxViewers, web->max_viewers).value_or(web->max_viewers));
  web->ros_distro = table.String("ros_distro", web->ros_distro).value_or("");
  if (web->ros_distro == "none") {
    web->ros_distro.clear();
  }
  web->click_pheromone = table.String("click_pheromone", web->click_pheromone).value_or("");
}

}  // namespace pheromone::config
