#pragma once

#include <cstdint>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::scenario {

/// Is told what panels really do and what really happens on the wire.
class Witness {
  public:
    virtual ~Witness() = default;
    /// A read: from now on its values are other ones.
    virtual void on_served(TimePoint now, std::uint8_t station) = 0;
    virtual void on_executed(TimePoint now, std::uint8_t station, ByteView pdu) = 0;
    virtual void on_exception(TimePoint now, std::uint8_t station, ByteView pdu) = 0;
    /// A second copy of an answer was delivered to its last byte.
    virtual void on_copy(TimePoint now, ByteView adu) = 0;
    /// A good answer was delivered to its last byte.
    virtual void on_reply(TimePoint now, ByteView adu) = 0;
    /// Somebody else than the gateway says this.
    virtual void on_said(TimePoint now, ByteView bytes) = 0;
    /// Bytes were delivered that nobody said.
    virtual void on_garbled(TimePoint now) = 0;
    virtual void on_collision(TimePoint now, std::uint8_t station) = 0;
};

}  // namespace panelgate::scenario
