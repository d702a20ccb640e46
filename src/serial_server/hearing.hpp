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

/// RTU on a line: the function and the header give the length, the CRC judges. What another unit
/// says may be a request to it or its reply, whichever is good, so that nobody's data is searched
/// for requests. Behind noise, a request that is served here, or a broadcast, counts only if a
/// silence follows: its master waits for the reply, while what looks like one inside of other
/// bytes is followed by more of them. What is no pure read counts there only behind up to three
/// bytes, a glitch: it may end the data of a damaged write, and a master says it again. Holds 260
/// bytes at most.
class RtuHearing final : public Hearing {
  public:
    explicit RtuHearing(const Units& served) : served_(served) {}

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<modbus::SerialAdu> next() override;
    void on_silence() override;
    void drop_pending() override;
    std::size_t pending() const override { return heard_.size(); }
    bool knows_rest() const override;
    std::size_t take_faults() override;

  private:
    struct Judgement {
        enum class Kind : std::uint8_t { frame, open, nothing };
        Kind kind = Kind::nothing;
        std::size_t size = 0;  ///< of a frame
    };
    bool concerns_us(std::uint8_t station) const { return station == 0 || served_[station]; }
    bool sure() const { return trusted_ || since_lost_ <= kGlitch; }
    bool may_take(std::size_t size) const;
    Judgement judge(ByteView start, bool aligned) const;
    Judgement weigh(modbus::ReplyLength length, ByteView start, bool aligned) const;
    bool step_to_last();
    modbus::SerialAdu take(std::size_t size);
    void step_over(std::size_t count);
    void consume(std::size_t count);
    void trust() { aligned_ = trusted_ = true; }

    static constexpr std::size_t kGlitch = 3;  ///< shorter than any frame's head
    Units served_;
    ByteQueue heard_;
    bool aligned_ = true;         ///< a frame begins at the front, if it is one
    bool trusted_ = true;         ///< ... and no damaged one can be around it
    std::size_t since_lost_ = 0;  ///< bytes, since that is not so
    bool silent_ = false;         ///< nothing has followed what was heard
    std::size_t faults_ = 0;
};

}  // namespace panelgate::serial_server
