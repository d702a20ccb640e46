#pragma once

#include <bitset>
#include <cstddef>
#include <memory>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/serial_adu.hpp"
#include "panelgate/serial_server/settings.hpp"

namespace panelgate::serial_server {

/// Ids that this gateway answers for.
using Units = std::bitset<256>;

/// Finds what a master says on a line where others may answer it, too. Take with next() until it
/// gives nothing before feeding more. Pure.
class Hearing {
  public:
    virtual ~Hearing() = default;

    virtual void feed(TimePoint now, ByteView bytes) = 0;
    /// A good frame, to or of anybody.
    virtual std::optional<modbus::SerialAdu> next() = 0;
    /// Nothing has come for t3.5: next() may give more.
    virtual void on_silence() = 0;
    /// Nothing more will come of what is pending: next() may give its end, the rest is dropped.
    virtual void drop_pending() = 0;
    /// Bytes that may become a frame, or a part of one.
    virtual std::size_t pending() const = 0;
    /// What is pending tells that it goes on, and how far: a silence is only a hole in it.
    virtual bool knows_rest() const = 0;
    /// How often something was no good, since the last call.
    virtual std::size_t take_faults() = 0;
};

/// As settings.access.framing says.
std::unique_ptr<Hearing> make_hearing(const Settings& settings, const Units& served);

}  // namespace panelgate::serial_server
