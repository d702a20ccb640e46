#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/bus/station_settings.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::bus {

/// Why nobody is asked: what may be done to a station does not include this request.
struct Refusal {
    Rule rule = Rule::read_only;
    std::string station;  ///< the name of the one that the rule protects
    modbus::ExceptionCode code = modbus::ExceptionCode::illegal_function;  ///< for Modbus clients
    std::string why{};  ///< a guard's own words; the name of a line that is only listened to

    friend bool operator==(const Refusal&, const Refusal&) = default;
};

/// What is answered to the function that is refused: Fault::denied, but of a guard the exception
/// that its panel would have answered.
Result<Bytes> answer_to(const Refusal& refusal, std::uint8_t function);

/// The one place that says who may do what on a line. Pure.
class Rights {
  public:
    Rights() = default;
    explicit Rights(Stations stations) : stations_(std::move(stations)) {}

    /// Station 0 is a broadcast.
    std::optional<Refusal> judge(std::uint8_t station, const modbus::Request& request) const;
    /// What judge() says to every write to this station, whatever it writes.
    std::optional<Refusal> judge_write(std::uint8_t station) const;

  private:
    std::optional<Refusal> judge_broadcast() const;

    Stations stations_;
};

}  // namespace panelgate::bus
