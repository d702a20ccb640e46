#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_polls.hpp"

namespace panelgate::mqtt {

// The Protocol Buffers wire format (protobuf.dev/programming-guides/encoding), as far as Sparkplug
// payloads need it.

/// Appends fields of a message.
class ProtobufWriter {
  public:
    ProtobufWriter& varint(unsigned field, std::uint64_t value);
    ProtobufWriter& fixed32(unsigned field, std::uint32_t value);
    ProtobufWriter& fixed64(unsigned field, std::uint64_t value);
    /// Appends bytes, a string or a message.
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
    std::uint64_t value = 0;   ///< of a varint or fixed field
    std::string_view bytes{};  ///< of a length-delimited field
    bool has_length = false;
};

/// Reads a message field by field, never past its end.
class ProtobufReader {
  public:
    explicit ProtobufReader(std::string_view text) : text_(text) {}

    /// Returns the next field; nullopt at the end, or if malformed (then ok() is false).
    std::optional<ProtobufField> next();
    bool ok() const { return ok_; }

  private:
    std::optional<std::uint64_t> varint();
    std::optional<std::uint64_t> little_endian(unsigned size);
    std::optional<ProtobufField> broken();

    std::string_view text_;
    bool ok_ = true;
};

/// Data types of Sparkplug B (Sparkplug 3.0, 6.4.16).
enum class DataType : std::uint32_t {
    int16 = 2,
    int32 = 3,
    int64 = 4,
    uint16 = 6,
    uint32 = 7,
    uint64 = 8,
    float32 = 9,
    float64 = 10,
    boolean = 11,
    string = 12,
};

/// A metric to publish.
struct Metric {
    std::string name{};  ///< empty: identified by alias only
    std::optional<std::uint64_t> alias{};
    WallTime time{};
    DataType type = DataType::boolean;
    bool historical = false;
    std::optional<points::Value> value{};      ///< nullopt: is_null
    std::optional<points::Quality> quality{};  ///< as the property Quality
    std::string unit{};                        ///< as the property engUnit; empty: none
};

/// Encodes a payload. `seq`: nullopt in an NDEATH.
std::string sparkplug_payload(WallTime time, const std::vector<Metric>& metrics,
                              std::optional<std::uint8_t> seq);

/// A metric received from a host.
struct ReceivedMetric {
    std::string name{};
    std::optional<std::uint64_t> alias{};
    std::optional<std::uint32_t> type{};
    std::optional<points::Value> value{};  ///< nullopt: null, or of an unsupported type
    bool is_integer = false;               ///< the type gives its signedness
};
/// Parses a payload; nullopt if malformed, or with more than `most` metrics.
std::optional<std::vector<ReceivedMetric>> parse_sparkplug(std::string_view text, std::size_t most);

/// Returns a metric's value; `fallback` is the type if it names none: integers are encoded
/// unsigned.
std::optional<points::Value> value_of(const ReceivedMetric& metric, DataType fallback);

}  // namespace panelgate::mqtt
