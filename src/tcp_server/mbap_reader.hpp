#pragma once

#include <optional>

#include "first_bytes.hpp"
#include "panelgate/modbus/mbap.hpp"
#include "request_reader.hpp"

namespace panelgate::tcp_server {

/// Modbus/TCP: what is broken beyond repair closes the connection (MBAP-05 to MBAP-07).
class MbapReader : public RequestReader {
  public:
    explicit MbapReader(const Settings& settings);

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<ReaderEvent> next(TimePoint now) override;
    bool partial() const override { return framer_.partial(); }
    std::optional<TimePoint> due() const override;
    void on_due(TimePoint now) override;
    void pause() override { begun_.reset(); }

  private:
    ReaderEvent on_other_protocol();

    Duration partial_timeout_;
    int bad_protocol_ids_allowed_;
    FirstBytes first_{modbus::Framing::tcp};
    modbus::MbapFramer framer_;
    int bad_protocol_ids_ = 0;        ///< in a row
    std::optional<TimePoint> begun_;  ///< the ADU that is not whole
    bool late_ = false;
};

}  // namespace panelgate::tcp_server
