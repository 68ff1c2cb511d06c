// Shared by several sections: tables, names, pheromones, addresses, files.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <system_error>
#include <utility>

#include "server/base/file.h"
#include "server/base/text.h"
#include "server/config/sections.h"

namespace pheromone::config {
namespace {

// Parses an address to listen on: `family` is AF_INET or AF_INET6.
bool IsAddress(int family, const std::string& text) {
  in6_addr address{};  // the larger of the two
  return inet_pton(family, text.c_str(), &address) == 1;
}

// The owner of the file is often not the user of the server.
std::string WhoMustReadIt(const std::string& path) {
  if (access(path.c_str(), R_OK) == 0 || errno != EACCES) {
    return "";
  }
  const passwd* user = getpwuid(geteuid());
  return " for the user " +
         (user != nullptr ? std::string(user->pw_name) : std::to_string(geteuid())) +
         ", as which the server runs; give the file to that user's group (chgrp) with mode 0640";
}

}  // namespace

const Value& TableOf(const Value& root, std::string_view name, Notes* notes) {
  static const Value empty_table;
  const Value* value = root.Find(name);
  if (value != nullptr && value->kind != Value::Kind::kTable) {
    notes->problems.Add(
        value->at, name,
        "found " + value->Describe() + ", expected a table [" + std::string(name) + "]");
    return empty_table;
  }
  return value != nullptr ? *value : empty_table;
}

std::vector<const Value*> TablesOf(const Value& root, std::string_view name, Notes* notes,
                                   size_t most) {
  std::vector<const Value*> tables;
  const Value* value = root.Find(name);
  if (value == nullptr) {
    return tables;
  }
  const auto refuse = [&](const Value& found) {
    notes->problems.Add(
        found.at, name,
        "found " + found.Describe() + ", expected tables [[" + std::string(name) + "]]");
  };
  if (value->kind != Value::Kind::kArray) {
    refuse(*value);
    return tables;
  }
  for (const Value& item : value->items) {
    if (tables.size() == most) {
      notes->problems.Add(item.at, name,
                          "found " + std::to_string(value->items.size()) +
                              " tables, expected at most " + std::to_string(most));
      break;
    }
    if (item.kind == Value::Kind::kTable) {
      tables.push_back(&item);
    } else {
      refuse(item);
    }
  }
  return tables;
}

std::string PathOf(std::string_view name, size_t index) {
  return std::string(name) + '[' + std::to_string(index + 1) + ']';
}

std::string ListOf(const std::vector<field::PheromoneLaw>& laws) {
  std::string list;
  for (const field::PheromoneLaw& law : laws) {
    if (!law.is_blend()) {
      list += (list.empty() ? "" : ", ") + std::to_string(law.type) + " or \"" + law.name + '"';
    }
  }
  return list;
}

const field::PheromoneLaw* ReadPheromoneOf(const TableReader& table,
                                           const field::FieldConfig& field) {
  const Value* value = table.Find("pheromone");
  if (value == nullptr) {
    table.Missing("pheromone", ListOf(field.pheromones));
    return nullptr;
  }
  for (const field::PheromoneLaw& law : field.pheromones) {
    const bool by_type = value->kind == Value::Kind::kInteger && value->integer == law.type;
    const bool by_name = value->kind == Value::Kind::kString && value->text == law.name;
    if ((by_type || by_name) && !law.is_blend()) {
      return &law;
    }
    if (by_type || by_name) {
      table.Expected("pheromone", *value,
                     ListOf(field.pheromones) + ": a blend has no pheromone of its own");
      return nullptr;
    }
  }
  table.Expected("pheromone", *value, ListOf(field.pheromones));
  return nullptr;
}

bool IsName(std::string_view text) {
  constexpr std::string_view kAllowed =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
  return !text.empty() && text.size() <= 32 &&
         text.find_first_not_of(kAllowed) == std::string_view::npos;
}

std::optional<std::string> ReadName(const TableReader& table) {
  auto name = table.String("name");
  if (name && !IsName(*name)) {
    table.Expected("name", *table.Find("name"), kNameExpected);
    return std::nullopt;
  }
  return name;
}

std::optional<Endpoint> ParseEndpoint(std::string_view text) {
  const size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) {
    return std::nullopt;
  }
  std::string_view address = text.substr(0, colon);
  const std::string_view port = text.substr(colon + 1);
  const bool brackets = address.size() > 2 && address.front() == '[' && address.back() == ']';
  if (brackets) {
    address = address.substr(1, address.size() - 2);
  }
  Endpoint endpoint{std::string(address), 0};
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), endpoint.port);
  const bool good = error == std::errc() && end == port.data() + port.size() && !port.empty() &&
                    IsAddress(brackets ? AF_INET6 : AF_INET, endpoint.address);
  return good ? std::optional(endpoint) : std::nullopt;
}

std::optional<Endpoint> ReadEndpoint(const TableReader& table, std::string_view key) {
  const auto text = table.String(key);
  auto endpoint = text ? ParseEndpoint(*text) : std::nullopt;
  if (text && !endpoint) {
    table.Expected(key, *table.Find(key),
                   "a numeric address and a port such as \"127.0.0.1:4950\" or \"[::1]:4950\"");
  }
  return endpoint;
}

std::string ExtensionOf(const std::filesystem::path& path) {
  return ToLower(path.extension().string());
}

std::optional<std::filesystem::path> ReadFileName(const TableReader& table, std::string_view key,
                                                  std::span<const std::string_view> extensions,
                                                  const Notes& notes) {
  const auto name = table.String(key);
  if (!name) {
    return std::nullopt;
  }
  const Value& value = *table.Find(key);
  const std::string extension = ExtensionOf(*name);
  if (!extensions.empty() &&
      std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
    std::string list;
    for (const std::string_view known : extensions) {
      list.append(list.empty() ? "" : ", ").append(known);
    }
    table.Expected(key, value, "a file whose name ends in one of " + list);
    return std::nullopt;
  }
  if (!notes.folder) {
    table.Expected(key, value, "no file, since this configuration was not read from a file");
    return std::nullopt;
  }
  // Pipes and devices are not read: reading might never end.
  std::filesystem::path path = *notes.folder / *name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    table.Report(key, path.string() + ": " + (error ? error.message() : "is not a regular file") +
                          ", expected a file");
    return std::nullopt;
  }
  return path;
}

std::optional<NamedFile> ReadNamedFile(const TableReader& table, std::string_view key,
                                       size_t max_bytes, const Notes& notes) {
  const auto path = ReadFileName(table, key, {}, notes);
  if (!path) {
    return std::nullopt;
  }
  Result<std::string> text = ReadFile(path->string(), max_bytes);
  if (!text.ok()) {
    table.Report(key, text.error() + WhoMustReadIt(path->string()));
    return std::nullopt;
  }
  return NamedFile{path->string(), std::move(text).value()};
}

void Warn(const TableReader& table, std::string_view key, const std::string& text, Notes* notes) {
  notes->warnings.push_back(
      {FormatProblem(notes->file, table.Find(key)->at, table.KeyOf(key), text), true});
}

std::string WhyNotSecret(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && (status.st_mode & S_IRWXO) != 0
             ? path + " is readable by all users, expected mode 0640 or stricter"
             : "";
}

}  // namespace pheromone::config
