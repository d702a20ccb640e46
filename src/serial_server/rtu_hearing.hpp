#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "hearing.hpp"
#include "panelgate/base/byte_queue.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/rtu_framer.hpp"
#include "panelgate/modbus/serial_adu.hpp"

namespace panelgate::serial_server {

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
