// One description of a struct's fields, from which its bytes, its hash, its bounds and its
// documentation follow:
//
//   struct BlendPart {
//     uint8_t type = 1;
//     int32_t weight_milli = 1000;
//
//     template <typename Self, typename Visit>
//     static void Fields(Self& it, Visit&& visit) {
//       visit("type", it.type, Within(1, 15));
//       visit("weight_milli", it.weight_milli, Within(-1'000'000, 1'000'000));
//     }
//   };
//
//   EncodeFields(part, &writer);             // each field, in this order (bytes.h)
//   BlendPart same;
//   DecodeFields(&reader, &same);            // fails the reader for invalid enumerators
//   Status good = CheckFields(part, "part"); // "part.weight_milli is 2000000, expected ..."
//   uint64_t hash = HashFields(part);        // Hash64 of the fields as words
//   std::string text = DescribeFields<BlendPart>();
//
// A field is an integer, a flag, an enumeration over uint8_t, a string, a struct with Fields (whose
// fields are inlined), an array of bytes, a list of these, an optional one, or a variant of structs
// with Fields and kName. Other types have a specialisation of FieldCodec. Pure; any thread.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/hash.h"
#include "server/base/result.h"

namespace pheromone {

/// What a field may hold.
struct FieldRule {
  int64_t least = std::numeric_limits<int64_t>::min();
  int64_t most = std::numeric_limits<int64_t>::max();

  bool bounded() const { return *this != FieldRule{}; }
  bool operator==(const FieldRule&) const = default;
};

constexpr FieldRule Within(int64_t least, int64_t most) {
  return {.least = least, .most = most};
}
constexpr FieldRule AtLeast(int64_t least) {
  return {.least = least};
}
/// For an enumeration that begins at 0: up to its last one.
template <typename Enum>
requires std::is_enum_v<Enum>
constexpr FieldRule UpTo(Enum last) {
  return Within(0, static_cast<int64_t>(last));
}

/// For other types. A specialisation has
///   static void Encode(const T&, ByteWriter*);
///   static void Decode(ByteReader*, T*);
///   static uint64_t Hash(const T&);
///   static Status Check(const T&, const std::string& name);
///   static size_t BytesAtMost(const T&);
///   static std::string Describe(std::string_view name, const std::string& indent);
template <typename T>
struct FieldCodec;

namespace fields {

struct Ignore {
  template <typename... Any>
  void operator()(Any&&... /*any*/) const {}
};

template <typename T>
concept Described = requires(const T& it) {
  T::Fields(it, Ignore{});
};
template <typename T>
concept HasCodec = requires(const T& it, ByteWriter* writer) {
  FieldCodec<T>::Encode(it, writer);
};

template <typename T>
struct IsList : std::false_type {};
template <typename T>
struct IsList<std::vector<T>> : std::true_type {};
template <typename T>
struct IsBytes : std::false_type {};
template <size_t n>
struct IsBytes<std::array<uint8_t, n>> : std::true_type {};

/// A struct whose fields count as one word in the hash of the one that holds it.
template <typename T>
concept HashedAlone = Described<T> && T::kHashedAlone;

template <typename T>
std::string_view NameOfType() {
  if constexpr (std::is_same_v<T, bool>) {
    return "flag";
  } else if constexpr (std::is_enum_v<T>) {
    return "u8";
  } else if constexpr (std::is_same_v<T, std::string>) {
    return "text";
  } else {
    constexpr std::array<std::string_view, 4> kUnsigned = {"u8", "u16", "u32", "u64"};
    constexpr std::array<std::string_view, 4> kSigned = {"i8", "i16", "i32", "i64"};
    constexpr size_t kWidth = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3;
    return std::is_signed_v<T> ? kSigned[kWidth] : kUnsigned[kWidth];
  }
}

}  // namespace fields

// --- Bytes

template <typename T>
void EncodeFields(const T& it, ByteWriter* writer) {
  if constexpr (fields::HasCodec<T>) {
    FieldCodec<T>::Encode(it, writer);
  } else if constexpr (fields::Described<T>) {
    T::Fields(it, [writer](std::string_view, const auto& field, FieldRule = {}) {
      EncodeFields(field, writer);
    });
  } else if constexpr (fields::IsList<T>::value) {
    writer->Count(it.size());
    for (const auto& item : it) {
      EncodeFields(item, writer);
    }
  } else if constexpr (fields::IsBytes<T>::value) {
    for (const uint8_t byte : it) {
      writer->U8(byte);
    }
  } else if constexpr (std::is_same_v<T, std::string>) {
    writer->Text(it);
  } else if constexpr (std::is_same_v<T, bool>) {
    writer->Flag(it);
  } else if constexpr (std::is_enum_v<T>) {
    static_assert(sizeof(T) == 1);
    writer->U8(static_cast<uint8_t>(it));
  } else if constexpr (sizeof(T) == 1) {
    writer->U8(static_cast<uint8_t>(it));
  } else if constexpr (sizeof(T) == 2) {
    writer->U16(static_cast<uint16_t>(it));
  } else if constexpr (sizeof(T) == 4) {
    writer->U32(static_cast<uint32_t>(it));
  } else {
    static_assert(std::is_integral_v<T> && sizeof(T) == 8);
    writer->U64(static_cast<uint64_t>(it));
  }
}

/// Checks only enumerators: CheckFields does the rest.
template <typename T>
void DecodeFields(ByteReader* reader, T* it, std::string_view name = "", FieldRule rule = {}) {
  if constexpr (fields::HasCodec<T>) {
    FieldCodec<T>::Decode(reader, it);
  } else if constexpr (fields::Described<T>) {
    T::Fields(*it, [reader](std::string_view its_name, auto& field, FieldRule its_rule = {}) {
      DecodeFields(reader, &field, its_name, its_rule);
    });
  } else if constexpr (fields::IsList<T>::value) {
    it->clear();
    for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
      DecodeFields(reader, &it->emplace_back());
    }
  } else if constexpr (fields::IsBytes<T>::value) {
    for (uint8_t& byte : *it) {
      byte = reader->U8();
    }
  } else if constexpr (std::is_same_v<T, std::string>) {
    *it = reader->Text();
  } else if constexpr (std::is_same_v<T, bool>) {
    *it = reader->Flag();
  } else if constexpr (std::is_enum_v<T>) {
    *it = static_cast<T>(rule.bounded() ? reader->U8UpTo(static_cast<uint8_t>(rule.most), name)
                                        : reader->U8());
  } else if constexpr (sizeof(T) == 1) {
    *it = static_cast<T>(reader->U8());
  } else if constexpr (sizeof(T) == 2) {
    *it = static_cast<T>(reader->U16());
  } else if constexpr (sizeof(T) == 4) {
    *it = static_cast<T>(reader->U32());
  } else {
    static_assert(std::is_integral_v<T> && sizeof(T) == 8);
    *it = static_cast<T>(reader->U64());
  }
}

/// An upper bound of the bytes that EncodeFields writes, exact without a FieldCodec. A list of
/// numbers is not visited item by item.
template <typename T>
size_t BytesAtMost(const T& it) {
  if constexpr (fields::HasCodec<T>) {
    return FieldCodec<T>::BytesAtMost(it);
  } else if constexpr (fields::Described<T>) {
    size_t bytes = 0;
    T::Fields(it, [&bytes](std::string_view, const auto& field, FieldRule = {}) {
      bytes += BytesAtMost(field);
    });
    return bytes;
  } else if constexpr (fields::IsList<T>::value) {
    constexpr size_t kCountBytes = 4;
    using Item = typename T::value_type;
    if constexpr (std::is_trivially_copyable_v<Item>) {
      return kCountBytes + it.size() * BytesAtMost(Item{});
    } else {
      size_t bytes = kCountBytes;
      for (const Item& item : it) {
        bytes += BytesAtMost(item);
      }
      return bytes;
    }
  } else if constexpr (std::is_same_v<T, std::string>) {
    constexpr size_t kLengthBytes = 4;
    return kLengthBytes + it.size();
  } else {
    return sizeof(T);
  }
}

// --- Hash

template <typename T>
uint64_t HashFields(const T& it);

namespace fields {

// Begins with the length, so that moving items between adjacent lists changes the hash.
template <typename T>
uint64_t HashList(const std::vector<T>& list) {
  uint64_t hash = HashStep(0, list.size());
  for (const T& item : list) {
    hash = HashStep(hash, HashFields(item));
  }
  return hash;
}

template <typename T>
uint64_t HashInto(uint64_t hash, const T& it) {
  if constexpr (HasCodec<T>) {
    return HashStep(hash, FieldCodec<T>::Hash(it));
  } else if constexpr (HashedAlone<T>) {
    return HashStep(hash, HashFields(it));
  } else if constexpr (Described<T>) {
    T::Fields(it, [&hash](std::string_view, const auto& field, FieldRule = {}) {
      hash = HashInto(hash, field);
    });
    return hash;
  } else if constexpr (IsList<T>::value) {
    return HashStep(hash, HashList(it));
  } else if constexpr (IsBytes<T>::value) {
    for (const uint8_t byte : it) {
      hash = HashStep(hash, byte);
    }
    return hash;
  } else if constexpr (std::is_same_v<T, std::string>) {
    return HashStep(hash, HashText(it));
  } else {
    return HashStep(hash, static_cast<uint64_t>(it));
  }
}

}  // namespace fields

/// Hash64 of the fields as words: a number, sign-extended; a text by HashText; a list as one word.
template <typename T>
uint64_t HashFields(const T& it) {
  uint64_t hash = 0;
  if constexpr (fields::Described<T>) {
    T::Fields(it, [&hash](std::string_view, const auto& field, FieldRule = {}) {
      hash = fields::HashInto(hash, field);
    });
    return hash;
  } else {
    return fields::HashInto(hash, it);
  }
}

// --- Bounds

namespace fields {

/// Whether there is anything to check, so that a list of a million points can be skipped.
template <typename T>
bool HasBounds(FieldRule rule = {}) {
  if constexpr (HasCodec<T>) {
    return true;
  } else if constexpr (Described<T>) {
    bool has_any = false;
    const T it{};
    T::Fields(it, [&has_any](std::string_view, const auto& field, FieldRule its_rule = {}) {
      has_any = has_any || HasBounds<std::remove_cvref_t<decltype(field)>>(its_rule);
    });
    return has_any;
  } else if constexpr (IsList<T>::value) {
    return HasBounds<typename T::value_type>();
  } else {
    return rule.bounded();
  }
}

}  // namespace fields

/// The first field out of bounds: "NAME.FIELD is VALUE, expected LEAST to MOST".
template <typename T>
Status CheckFields(const T& it, const std::string& name, FieldRule rule = {}) {
  if constexpr (fields::HasCodec<T>) {
    return FieldCodec<T>::Check(it, name);
  } else if constexpr (fields::Described<T>) {
    Status found = Ok();
    T::Fields(it, [&](std::string_view its_name, const auto& field, FieldRule its_rule = {}) {
      if (found.ok()) {
        found = CheckFields(
            field, name.empty() ? std::string(its_name) : name + "." + std::string(its_name),
            its_rule);
      }
    });
    return found;
  } else if constexpr (fields::IsList<T>::value) {
    if (!fields::HasBounds<typename T::value_type>()) {
      return Ok();
    }
    for (size_t i = 0; i < it.size(); ++i) {
      PHEROMONE_TRY_STATUS(CheckFields(it[i], name + "[" + std::to_string(i) + "]"));
    }
    return Ok();
  } else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
    const auto value = static_cast<int64_t>(it);
    if (value >= rule.least && value <= rule.most) {
      return Ok();
    }
    std::string error = name + " is " + std::to_string(value) + ", expected ";
    if (rule.most == std::numeric_limits<int64_t>::max()) {
      error += "at least " + std::to_string(rule.least);
    } else {
      error += std::to_string(rule.least) + " to " + std::to_string(rule.most);
    }
    return Error{std::move(error)};
  } else {
    return Ok();
  }
}

// --- Documentation

namespace fields {

template <typename T>
std::string Describe(std::string_view name, const std::string& indent, FieldRule rule) {
  if constexpr (HasCodec<T>) {
    return FieldCodec<T>::Describe(name, indent);
  } else if constexpr (Described<T>) {
    std::string text;
    const T it{};
    T::Fields(it, [&](std::string_view its_name, const auto& field, FieldRule its_rule = {}) {
      std::string whole(name);
      whole += whole.empty() ? "" : ".";
      whole += its_name;
      text += Describe<std::remove_cvref_t<decltype(field)>>(whole, indent, its_rule);
    });
    return text;
  } else if constexpr (IsList<T>::value) {
    return indent + "list " + std::string(name) + ", each\n" +
           Describe<typename T::value_type>("", indent + "  ", {});
  } else if constexpr (IsBytes<T>::value) {
    return indent + std::to_string(T{}.size()) + " bytes " + std::string(name) + "\n";
  } else {
    std::string text = indent + std::string(NameOfType<T>()) + " " + std::string(name);
    const bool has_most = rule.most != std::numeric_limits<int64_t>::max();
    if (rule.least != std::numeric_limits<int64_t>::min()) {
      text += has_most ? ": " + std::to_string(rule.least) + " to " + std::to_string(rule.most)
                       : ": at least " + std::to_string(rule.least);
    }
    return text + "\n";
  }
}

}  // namespace fields

/// A line for each field in the order of its bytes: type, name, bounds. The items of a list are
/// indented.
template <typename T>
std::string DescribeFields(const std::string& indent = "") {
  return fields::Describe<T>("", indent, {});
}

// --- What may be missing, and what is one of several. Neither has a hash.

template <typename T>
struct FieldCodec<std::optional<T>> {
  static void Encode(const std::optional<T>& it, ByteWriter* writer) {
    writer->Flag(it.has_value());
    if (it) {
      EncodeFields(*it, writer);
    }
  }
  static void Decode(ByteReader* reader, std::optional<T>* it) {
    it->reset();
    if (reader->Flag()) {
      DecodeFields(reader, &it->emplace());
    }
  }
  static Status Check(const std::optional<T>& it, const std::string& name) {
    return it ? CheckFields(*it, name) : Ok();
  }
  static size_t BytesAtMost(const std::optional<T>& it) {
    return 1 + (it ? pheromone::BytesAtMost(*it) : 0);
  }
  static std::string Describe(std::string_view name, const std::string& indent) {
    return indent + "flag " + std::string(name) + "; if it is 1:\n" +
           fields::Describe<T>(name, indent + "  ", {});
  }
};

/// The index of the alternative, and its fields.
template <typename... Alternatives>
struct FieldCodec<std::variant<Alternatives...>> {
  using Variant = std::variant<Alternatives...>;

  static void Encode(const Variant& it, ByteWriter* writer) {
    writer->U8(static_cast<uint8_t>(it.index()));
    std::visit([writer](const auto& alternative) { EncodeFields(alternative, writer); }, it);
  }
  static void Decode(ByteReader* reader, Variant* it) {
    const size_t index = reader->U8UpTo(sizeof...(Alternatives) - 1, "the kind of an alternative");
    size_t next = 0;
    ((next++ == index ? DecodeFields(reader, &it->template emplace<Alternatives>()) : void()), ...);
  }
  static Status Check(const Variant& it, const std::string& name) {
    return std::visit([&](const auto& alternative) { return CheckFields(alternative, name); }, it);
  }
  static size_t BytesAtMost(const Variant& it) {
    return 1 + std::visit([](const auto& its) { return pheromone::BytesAtMost(its); }, it);
  }
  static std::string Describe(std::string_view name, const std::string& indent) {
    std::string text = indent + "u8 " + std::string(name) + ", and\n";
    size_t index = 0;
    ((text += indent + "  if it is " + std::to_string(index++) + ", " +
              std::string(Alternatives::kName) + ":\n" +
              fields::Describe<Alternatives>("", indent + "    ", {})),
     ...);
    return text;
  }
};

}  // namespace pheromone
