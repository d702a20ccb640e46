#pragma once

#include <cstddef>
#include <optional>

#include "first_bytes.hpp"
#include "panelgate/modbus/ascii_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"
#include "panelgate/modbus/serial_adu.hpp"
#include "request_reader.hpp"

namespace panelgate::tcp_server {

/// What RTU and ASCII have in common: what is no frame is stepped over, and only a client that
/// sends nothing else is closed.
class SerialReader : public RequestReader {
  protected:
    explicit SerialReader(const Settings& settings)
        : first_(settings.framing), garbage_limit_(settings.garbage_limit) {}
    void look_at(ByteView bytes) { first_.feed(bytes); }
    /// Of what the framer has given; it need not be asked for more.
    bool has_more_to_tell() const { return untold_ > 0 || held_; }
    /// What is to be told now. `discarded`: bytes since the last good frame; `faults`: new ones.
    std::optional<ReaderEvent> tell(std::optional<modbus::SerialAdu> adu, std::size_t discarded,
                                    std::size_t faults);

  private:
    FirstBytes first_;
    std::size_t garbage_limit_;
    std::size_t untold_ = 0;                 ///< faults
    std::optional<modbus::SerialAdu> held_;  ///< until they are told
};

/// RTU frames in a stream. A silence ends what nothing else ends, and gives up a start that holds
/// up a good frame; half a request is given up after partial_adu_timeout.
class RtuReader : public SerialReader {
  public:
    explicit RtuReader(const Settings& settings);

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<ReaderEvent> next(TimePoint now) override;
    bool partial() const override { return framer_.partial(); }
    std::optional<TimePoint> due() const override;
    void on_due(TimePoint now) override;
    void on_end() override { framer_.on_silence(); }
    void pause() override {
        begun_.reset();
        unread_ = true;
    }

  private:
    Duration silence_;
    Duration partial_timeout_;
    modbus::RtuRequestFramer framer_;
    TimePoint heard_{};        ///< last byte
    bool was_silent_ = false;  ///< since, and that has been looked at
    bool unread_ = false;      ///< for a while: whether there was a silence nobody knows
    std::optional<TimePoint> begun_;
};

/// ASCII frames in a stream. What is late is only looked at when more comes.
class AsciiReader : public SerialReader {
  public:
    explicit AsciiReader(const Settings& settings);

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<ReaderEvent> next(TimePoint now) override;
    bool partial() const override { return framer_.partial(); }
    std::optional<TimePoint> due() const override { return std::nullopt; }
    void on_due(TimePoint) override {}
    void pause() override {}

  private:
    modbus::AsciiFramer framer_;
};

}  // namespace panelgate::tcp_server
