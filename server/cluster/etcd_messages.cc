#include "server/cluster/etcd_messages.h"

#include <charconv>
#include <optional>
#include <system_error>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/monotonic_resource.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <boost/system/error_code.hpp>

#include "server/base/base64.h"
#include "server/base/escape.h"

namespace pheromone::cluster {
namespace {

namespace json = boost::json;

std::string Quote(std::string_view text) {
  std::string quoted = "\"";
  quoted += text;
  return quoted + '"';
}

std::string QuoteBytes(std::string_view bytes) {
  return Quote(ToBase64(bytes));
}

std::string QuoteNumber(uint64_t number) {
  return Quote(std::to_string(number));
}

std::string KeyField(std::string_view key) {
  return "\"key\":" + QuoteBytes(key);
}

std::string RangeFields(std::string_view begin, std::string_view end) {
  return KeyField(begin) + ",\"range_end\":" + QuoteBytes(end);
}

void Join(std::string* list, std::string_view item) {
  *list += list->empty() ? "" : ",";
  *list += item;
}

Error Unexpected(std::string_view field, std::string_view expected) {
  return Error{"field \"" + std::string(field) + "\": expected " + std::string(expected)};
}

Error Canceled(std::string_view reason) {
  return Error{"etcd canceled the watch: " +
               (reason.empty() ? "no reason given" : EscapeControls(reason, ""))};
}

// Members of an object; what is absent is empty or zero.
Result<uint64_t> Number(const json::object& object, std::string_view field) {
  const json::value* const value = object.if_contains(field);
  if (value == nullptr) {
    return uint64_t{0};
  }
  const json::string* const text = value->if_string();
  uint64_t number = 0;
  if (text != nullptr) {
    const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), number);
    if (error == std::errc{} && end == text->data() + text->size()) {
      return number;
    }
  }
  return Unexpected(field, "a number in a string");
}

Result<bool> Boolean(const json::object& object, std::string_view field) {
  const json::value* const value = object.if_contains(field);
  if (value == nullptr) {
    return false;
  }
  if (!value->is_bool()) {
    return Unexpected(field, "true or false");
  }
  return value->get_bool();
}

Result<std::string> Text(const json::object& object, std::string_view field) {
  const json::value* const value = object.if_contains(field);
  if (value == nullptr) {
    return std::string();
  }
  if (!value->is_string()) {
    return Unexpected(field, "a string");
  }
  return std::string(value->get_string());
}

Result<std::string> Bytes(const json::object& object, std::string_view field) {
  const json::value* const value = object.if_contains(field);
  if (value == nullptr) {
    return std::string();
  }
  if (!value->is_string()) {
    return Unexpected(field, "Base64");
  }
  Result<std::string> bytes = FromBase64(value->get_string());
  if (!bytes.ok()) {
    return Unexpected(field, "Base64: " + bytes.error());
  }
  return bytes;
}

const json::object kNoFields;
const json::array kNoItems;

Result<const json::object*> Object(const json::object& object, std::string_view field) {
  const json::value* const value = object.if_contains(field);
  if (value == nullptr) {
    return &kNoFields;
  }
  if (!value->is_object()) {
    return Unexpected(field, "an object");
  }
  return &value->get_object();
}

Result<const json::array*> Array(const json::object& object, std::string_view field) {
  const json::value* const value = object.if_contains(field);
  if (value == nullptr) {
    return &kNoItems;
  }
  if (!value->is_array()) {
    return Unexpected(field, "a list");
  }
  return &value->get_array();
}

Result<const json::object*> ItemObject(const json::value& item, std::string_view field) {
  if (!item.is_object()) {
    return Unexpected(field, "a list of objects");
  }
  return &item.get_object();
}

// `value` refers into `memory`.
struct Document {
  json::monotonic_resource memory;
  std::optional<json::value> value;
};

Result<const json::object*> Parse(std::string_view text, Document* document) {
  boost::system::error_code error;
  document->value.emplace(json::parse({text.data(), text.size()}, error, &document->memory));
  if (error) {
    return Error{"not JSON: " + error.message()};
  }
  const json::object* const object = document->value->if_object();
  if (object == nullptr) {
    return Error{"expected an object"};
  }
  return object;
}

Result<Entry> ReadEntry(const json::object& kv) {
  Entry entry;
  PHEROMONE_TRY(entry.key, Bytes(kv, "key"));
  Result<std::string> value = Bytes(kv, "value");
  if (!value.ok()) {
    return Error{"key " + EscapeControls(entry.key, "") + ": " + value.error()};
  }
  entry.value = std::move(value).value();
  PHEROMONE_TRY(entry.revision, Number(kv, "mod_revision"));
  return entry;
}

Result<TxnAnswer::Part> ReadPart(const json::object& response) {
  TxnAnswer::Part part;
  PHEROMONE_TRY(const json::object* const range, Object(response, "response_range"));
  PHEROMONE_TRY(const json::array* const kvs, Array(*range, "kvs"));
  for (const json::value& item : *kvs) {
    PHEROMONE_TRY(const json::object* const kv, ItemObject(item, "kvs"));
    PHEROMONE_TRY(Entry entry, ReadEntry(*kv));
    part.entries.push_back(std::move(entry));
  }
  PHEROMONE_TRY(part.more, Boolean(*range, "more"));
  return part;
}

}  // namespace

void Operations::Add(std::string_view operation) {
  Join(&text_, operation);
}

void Operations::Put(std::string_view key, std::string_view value) {
  Add("{\"request_put\":{" + KeyField(key) + ",\"value\":" + QuoteBytes(value) + "}}");
}

void Operations::Read(std::string_view key) {
  Add("{\"request_range\":{" + KeyField(key) + "}}");
}

void Operations::ReadRange(std::string_view begin, std::string_view end, uint32_t limit) {
  Add("{\"request_range\":{" + RangeFields(begin, end) + ",\"limit\":" + QuoteNumber(limit) + "}}");
}

void Operations::ReadLast(std::string_view begin, std::string_view end) {
  Add("{\"request_range\":{" + RangeFields(begin, end) +
      ",\"limit\":\"1\",\"sort_order\":\"DESCEND\",\"sort_target\":\"KEY\"}}");
}

void Operations::DeleteRange(std::string_view begin, std::string_view end) {
  Add("{\"request_delete_range\":{" + RangeFields(begin, end) + "}}");
}

void TxnRequest::Compare(std::string_view text) {
  Join(&comparisons_, text);
}

void TxnRequest::IfChangedAt(std::string_view key, Revision revision) {
  Compare("{\"target\":\"MOD\",\"result\":\"EQUAL\"," + KeyField(key) +
          ",\"mod_revision\":" + QuoteNumber(revision) + "}");
}

void TxnRequest::IfAbsent(std::string_view key) {
  Compare("{\"target\":\"CREATE\",\"result\":\"EQUAL\"," + KeyField(key) +
          ",\"create_revision\":\"0\"}");
}

void TxnRequest::CompareValue(std::string_view how, std::string_view key, std::string_view value) {
  Compare("{\"target\":\"VALUE\",\"result\":" + Quote(how) + "," + KeyField(key) +
          ",\"value\":" + QuoteBytes(value) + "}");
}

void TxnRequest::IfEqual(std::string_view key, std::string_view value) {
  CompareValue("EQUAL", key, value);
}

void TxnRequest::IfGreater(std::string_view key, std::string_view value) {
  CompareValue("GREATER", key, value);
}

std::string TxnRequest::Text() const {
  return "{\"compare\":[" + comparisons_ + "],\"success\":[" + success.text() + "],\"failure\":[" +
         failure.text() + "]}";
}

std::string CompactionRequest(Revision revision) {
  return "{\"revision\":" + QuoteNumber(revision) + "}";
}

// Fragments keep each line below the size of a request, however far behind the watch begins.
std::string WatchRequest(std::string_view begin, std::string_view end, Revision revision) {
  return "{\"create_request\":{" + RangeFields(begin, end) +
         ",\"start_revision\":" + QuoteNumber(revision) + ",\"fragment\":true}}";
}

std::string TransferRequest(uint64_t member) {
  return "{\"targetID\":" + QuoteNumber(member) + "}";
}

Result<TxnAnswer> ParseTxn(std::string_view text, size_t success_parts, size_t failure_parts) {
  Document document;
  PHEROMONE_TRY(const json::object* const top, Parse(text, &document));
  TxnAnswer answer;
  PHEROMONE_TRY(const json::object* const header, Object(*top, "header"));
  PHEROMONE_TRY(answer.revision, Number(*header, "revision"));
  if (answer.revision == 0) {  // of any store it is at least 1
    return Unexpected("header.revision", "a number in a string");
  }
  PHEROMONE_TRY(answer.succeeded, Boolean(*top, "succeeded"));
  PHEROMONE_TRY(const json::array* const responses, Array(*top, "responses"));
  const size_t expected = answer.succeeded ? success_parts : failure_parts;
  if (responses->size() != expected) {
    return Unexpected("responses",
                      std::to_string(expected) + ", received " + std::to_string(responses->size()));
  }
  for (const json::value& item : *responses) {
    PHEROMONE_TRY(const json::object* const response, ItemObject(item, "responses"));
    PHEROMONE_TRY(TxnAnswer::Part part, ReadPart(*response));
    answer.parts.push_back(std::move(part));
  }
  return answer;
}

Result<TxnAnswer> ParseRead(std::string_view text, size_t parts) {
  PHEROMONE_TRY(TxnAnswer answer, ParseTxn(text, parts, 0));
  if (!answer.succeeded) {
    return Unexpected("succeeded", "true");
  }
  return answer;
}

Result<WatchAnswer> ParseWatch(std::string_view line) {
  Document document;
  PHEROMONE_TRY(const json::object* const top, Parse(line, &document));
  if (top->contains("error")) {
    PHEROMONE_TRY(const json::object* const error, Object(*top, "error"));
    PHEROMONE_TRY(const std::string message, Text(*error, "message"));
    return Canceled(message);
  }
  if (!top->contains("result")) {
    return Unexpected("result", "an object");
  }
  PHEROMONE_TRY(const json::object* const result, Object(*top, "result"));
  PHEROMONE_TRY(const uint64_t compacted, Number(*result, "compact_revision"));
  PHEROMONE_TRY(const bool is_canceled, Boolean(*result, "canceled"));
  if (is_canceled && compacted == 0) {
    PHEROMONE_TRY(const std::string reason, Text(*result, "cancel_reason"));
    return Canceled(reason);
  }
  WatchAnswer answer;
  answer.is_compacted = is_canceled;
  PHEROMONE_TRY(const json::array* const events, Array(*result, "events"));
  for (const json::value& item : *events) {
    PHEROMONE_TRY(const json::object* const event, ItemObject(item, "events"));
    WatchAnswer::Change change;
    PHEROMONE_TRY(const std::string type, Text(*event, "type"));
    if (!type.empty() && type != "PUT" && type != "DELETE") {
      return Unexpected("type", "PUT or DELETE");
    }
    change.is_deleted = type == "DELETE";
    PHEROMONE_TRY(const json::object* const kv, Object(*event, "kv"));
    PHEROMONE_TRY(change.entry, ReadEntry(*kv));
    answer.changes.push_back(std::move(change));
  }
  return answer;
}

Result<StatusAnswer> ParseStatus(std::string_view text) {
  Document document;
  PHEROMONE_TRY(const json::object* const top, Parse(text, &document));
  PHEROMONE_TRY(const json::object* const header, Object(*top, "header"));
  StatusAnswer answer;
  PHEROMONE_TRY(answer.member, Number(*header, "member_id"));
  PHEROMONE_TRY(answer.leader, Number(*top, "leader"));
  return answer;
}

std::string ErrorOf(std::string_view text) {
  constexpr size_t kMaxQuoted = 100;
  Document document;
  const Result<const json::object*> top = Parse(text, &document);
  if (top.ok()) {
    const Result<std::string> message = Text(*top.value(), "message");
    if (message.ok() && !message.value().empty()) {
      return EscapeControls(message.value(), "");
    }
  }
  return "\"" + EscapeControls(text.substr(0, kMaxQuoted), "") + "\"";
}

}  // namespace pheromone::cluster
