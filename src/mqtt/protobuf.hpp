#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace panelgate::mqtt {

// The wire format of Protocol Buffers (protobuf.dev/programming-guides/encoding), as far as a
// Sparkplug payload needs it.

/// Appends fields of a message.
class ProtobufWriter {
  public:
    ProtobufWriter& varint(unsigned field, std::uint64_t value);
    ProtobufWriter& fixed32(unsigned field, std::uint32_t value);
    ProtobufWriter& fixed64(unsigned field, std::uint64_t value);
    /// Bytes, a text or a message.
    ProtobufWriter& bytes(unsigned field, std::string_view value);

    std::string take() { return std::move(text_); }

  private:
    void raw(std::uint64_t value);
    void little_endian(std::uint64_t value, unsigned size);

    std::string text_;
};

/// A field of a message.
struct ProtobufField {
    unsigned number = 0;
    std::uint64_t value = 0;   ///< of a varint or a fixed one
    std::string_view bytes{};  ///< of one with a length
    bool has_length = false;
};

/// The fields of a message, one after the other. Reads nothing that is not there.
class ProtobufReader {
  public:
    explicit ProtobufReader(std::string_view text) : text_(text) {}

    /// Nothing at the end, and where the text is broken (then ok() is false).
    std::optional<ProtobufField> next();
    bool ok() const { return ok_; }

  private:
    std::optional<std::uint64_t> varint();
    std::optional<std::uint64_t> little_endian(unsigned size);
    std::optional<ProtobufField> broken();

    std::string_view text_;
    bool ok_ = true;
};

}  // namespace panelgate::mqtt
