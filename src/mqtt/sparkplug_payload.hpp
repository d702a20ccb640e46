#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/wall_time.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/points/value.hpp"

namespace panelgate::mqtt {

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
