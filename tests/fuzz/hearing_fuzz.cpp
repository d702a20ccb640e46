#include "hearing.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>

#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

using namespace panelgate;
using namespace panelgate::serial_server;

namespace {

constexpr std::uint8_t kServed = 1;
const Bytes kRead{3, 0, 7, 0, 1};

/// One way of hearing, and all that it was given.
class Ear {
  public:
    explicit Ear(modbus::Framing framing) : framing_(framing) {
        Settings settings;
        settings.access.framing = framing;
        Units served;
        served[kServed] = served[kServed + 1u] = true;
        hearing_ = make_hearing(settings, served);
    }

    Bytes framed(std::uint8_t station, ByteView pdu) const {
        return modbus::encode_reply(framing_, 0, station, pdu);
    }
    void feed(ByteView bytes) {
        stream_.insert(stream_.end(), bytes.begin(), bytes.end());
        hearing_->feed(now_, bytes);
        take();
    }
    void be_silent() {
        hearing_->on_silence();
        take();
    }
    /// Nothing is left, and the next request is heard by itself.
    void drop() {
        hearing_->drop_pending();
        take();
        if (hearing_->pending() != 0) std::abort();
        given_ = stream_.size();
        const std::size_t before = heard_;
        feed(framed(kServed, kRead));
        be_silent();  // behind noise it does not count before
        if (heard_ != before + 1 || hearing_->pending() != 0) std::abort();
    }
    void pass(Duration by) { now_ += by; }
    void judge() {
        if (hearing_->take_faults() > stream_.size()) std::abort();
    }

  private:
    /// Each frame stands in the stream, behind the one before it; no byte is given twice.
    void take() {
        while (const auto adu = hearing_->next()) {
            ++heard_;
            if (adu->pdu.empty() || adu->pdu.size() + modbus::kAduOverhead > kMost) std::abort();
            if (framing_ == modbus::Framing::rtu) place(framed(adu->station, adu->pdu));
        }
        if (hearing_->pending() > kMost) std::abort();
    }
    void place(const Bytes& frame) {
        const auto from = stream_.begin() + static_cast<std::ptrdiff_t>(given_);
        const auto at = std::search(from, stream_.end(), frame.begin(), frame.end());
        if (at == stream_.end()) std::abort();
        given_ = static_cast<std::size_t>(at - stream_.begin()) + frame.size();
    }

    static constexpr std::size_t kMost = 260;  ///< bytes of the longest frame
    modbus::Framing framing_;
    std::unique_ptr<Hearing> hearing_;
    TimePoint now_{1h};
    Bytes stream_;
    std::size_t given_ = 0;  ///< of them, up to the last frame
    std::size_t heard_ = 0;  ///< frames
};

}  // namespace

/// Whatever a master and its other slaves say, in whatever pieces: what is heard was said, in order
/// and once, little is kept, and behind a dropped rest the next request is heard. The first byte of
/// a piece tells its size and what follows it: more, t3.5 of silence, or its end; "F" in front of a
/// piece makes it a good frame.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    for (const modbus::Framing framing : {modbus::Framing::rtu, modbus::Framing::ascii}) {
        Ear ear(framing);
        ByteView left(data, size);
        while (left.size() >= 2) {
            const bool sealed = left[0] == 'F';
            if (sealed) left = left.subspan(1);
            const unsigned then = left[0] >> 6;
            const std::size_t n = std::min<std::size_t>(left[0] & 0x3F, left.size() - 1);
            const ByteView piece = left.subspan(1, n);
            ear.feed(sealed && n > 1 ? ByteView(ear.framed(piece[0], piece.subspan(1))) : piece);
            if (then == 1) ear.be_silent();
            if (then == 2) ear.drop();
            if (then == 3) ear.pass(700ms);
            left = left.subspan(1 + n);
        }
        ear.be_silent();
        ear.drop();
        ear.judge();
    }
    return 0;
}
