#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/points/value.hpp"

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

/// A metric that is told.
struct Metric {
    std::string name{};  ///< empty: its alias alone
    std::optional<std::uint64_t> alias{};
    WallTime time{};
    DataType type = DataType::boolean;
    bool historical = false;
    std::optional<points::Value> value{};      ///< nothing: is_null
    std::optional<points::Quality> quality{};  ///< as the property Quality
    std::string unit{};                        ///< as the property engUnit; empty: none
};

/// What the whole payload says. `seq`: nothing in an NDEATH.
std::string sparkplug_payload(WallTime time, const std::vector<Metric>& metrics,
                              std::optional<std::uint8_t> seq);

/// A metric that a host has sent.
struct HeardMetric {
    std::string name{};
    std::optional<std::uint64_t> alias{};
    std::optional<std::uint32_t> type{};
    std::optional<points::Value> value{};  ///< nothing: null, or of a kind that no point has
    bool is_integer = false;               ///< its sign follows from the type
};
/// Nothing when the text is no payload, or has more than `most` metrics.
std::optional<std::vector<HeardMetric>> parse_sparkplug(std::string_view text, std::size_t most);

/// What a metric means, where `fallback` is its type if it does not say: integers stand there
/// without a sign.
std::optional<points::Value> value_of(const HeardMetric& metric, DataType fallback);

}  // namespace panelgate::mqtt
