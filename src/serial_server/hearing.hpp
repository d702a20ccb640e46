#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"
#include "panelgate/serial_server/settings.hpp"

namespace panelgate::serial_server {

/// Unit ids the gateway answers for.
using Units = std::bitset<256>;

/// Finds a master's requests on a line where other slaves may answer it, too. Call next() until it
/// returns nothing before feeding more. Pure.
class Hearing {
  public:
    virtual ~Hearing() = default;

    virtual void feed(TimePoint now, ByteView bytes) = 0;
    /// Returns the next good frame, to or from any unit.
    virtual std::optional<modbus::SerialAdu> next() = 0;
    /// The line was silent for t3.5: next() may return more.
    virtual void on_silence() = 0;
    /// The pending bytes will not be continued: next() may return a frame at their end, the rest is
    /// dropped.
    virtual void drop_pending() = 0;
    /// Returns the number of bytes that may belong to an incomplete frame.
    virtual std::size_t pending() const = 0;
    /// True if the pending bytes announce a longer frame: a silence is then only a gap in it.
    virtual bool knows_length() const = 0;
    /// Returns the number of framing faults since the last call.
    virtual std::size_t take_faults() = 0;
    /// The gateway answers for these units from now on.
    virtual void serve(const Units& served) = 0;
};

/// Creates the parser for settings.access.framing.
std::unique_ptr<Hearing> make_hearing(const Settings& settings, const Units& served);

/// RTU on a line: function and header give the length, the CRC validates. A frame of another unit
/// may be a request or a reply, whichever is valid, so that its data is not searched for requests.
/// After noise, a request to a served unit or a broadcast is valid only if a silence follows: its
/// master waits for the reply, while a lookalike inside other data is followed by more bytes.
/// Anything but a pure read is accepted there only after up to three bytes, a glitch, or after a
/// silence that has ended the noise: else it may be the tail of a damaged write, and a master
/// repeats a lost one. Noise that announces a longer frame is ended by no silence: an adapter makes
/// such ones inside a frame. Buffers at most 260 bytes.
class RtuHearing final : public Hearing {
  public:
    explicit RtuHearing(const Units& served) : served_(served) {}

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<modbus::SerialAdu> next() override;
    void on_silence() override;
    void drop_pending() override;
    std::size_t pending() const override { return heard_.size(); }
    bool knows_length() const override { return missing() > 0; }
    std::size_t take_faults() override;
    void serve(const Units& served) override { served_ = served; }

  private:
    struct Judgement {
        enum class Kind : std::uint8_t { frame, open, nothing };
        Kind kind = Kind::nothing;
        std::size_t size = 0;  ///< of the frame
    };
    bool is_for_us(std::uint8_t station) const { return station == 0 || served_[station]; }
    bool sure() const { return trusted_ || since_lost_ <= kGlitch; }
    bool is_acceptable(std::size_t size) const;
    Judgement judge(ByteView start, bool aligned) const;
    Judgement check_length(modbus::ReplyLength length, ByteView start, bool aligned) const;
    std::size_t missing() const;
    bool skip_to_last_frame();
    modbus::SerialAdu take(std::size_t size);
    void step_over(std::size_t count);
    void consume(std::size_t count);
    void trust() { aligned_ = trusted_ = true; }

    static constexpr std::size_t kGlitch = 3;  ///< bytes; shorter than any frame's header
    Units served_;
    ByteQueue heard_;
    bool aligned_ = true;         ///< the front is a frame boundary
    bool trusted_ = true;         ///< ... and cannot be inside a damaged frame
    std::size_t since_lost_ = 0;  ///< bytes since trust was lost, or since the silence behind that
    std::size_t to_silence_ = 0;  ///< bytes before the last silence that ended them; 0: none
    bool silent_ = false;         ///< a silence followed the last byte
    std::size_t faults_ = 0;
};

}  // namespace panelgate::serial_server
