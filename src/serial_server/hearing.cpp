#include "hearing.hpp"

#include <utility>

#include "panelgate/modbus/ascii_frame.hpp"
#include "panelgate/modbus/framing.hpp"
#include "rtu_hearing.hpp"

namespace panelgate::serial_server {
namespace {

/// ASCII says by itself where a frame begins and ends, and whose it is.
class AsciiHearing final : public Hearing {
  public:
    explicit AsciiHearing(const tcp_server::Settings& access)
        : fresh_(access.ascii_digits, access.ascii_pause), framer_(fresh_) {}

    void feed(TimePoint now, ByteView bytes) override { framer_.feed(now, bytes); }
    std::optional<modbus::SerialAdu> next() override { return framer_.next(); }
    void on_silence() override {}
    void drop_pending() override {
        if (framer_.partial()) ++dropped_;
        framer_ = fresh_;
    }
    std::size_t pending() const override { return framer_.partial() ? modbus::kMinAsciiAdu : 0; }
    bool knows_rest() const override { return framer_.partial(); }
    std::size_t take_faults() override {
        return framer_.take_faults() + std::exchange(dropped_, 0);
    }

  private:
    modbus::AsciiFramer fresh_;
    modbus::AsciiFramer framer_;
    std::size_t dropped_ = 0;
};

}  // namespace

std::unique_ptr<Hearing> make_hearing(const Settings& settings, const Units& served) {
    if (settings.access.framing == modbus::Framing::ascii)
        return std::make_unique<AsciiHearing>(settings.access);
    return std::make_unique<RtuHearing>(served);
}

}  // namespace panelgate::serial_server
