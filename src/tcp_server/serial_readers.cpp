#include "serial_readers.hpp"

#include <string>
#include <utility>

namespace panelgate::tcp_server {

std::optional<ReaderEvent> SerialReader::tell(std::optional<modbus::SerialAdu> adu,
                                              std::size_t discarded, std::size_t faults) {
    if (auto objection = first_.take_objection()) return std::move(*objection);
    untold_ += faults;
    if (adu) held_ = std::move(adu);
    if (untold_ > 0) {
        --untold_;
        return Discarded{};
    }
    if (held_) {
        first_.on_request();
        modbus::SerialAdu given = *std::exchange(held_, std::nullopt);
        return modbus::Adu{0, given.station, std::move(given.pdu)};
    }
    if (discarded <= garbage_limit_) return std::nullopt;
    return Unusable{"no request in " + std::to_string(discarded) + " bytes"};
}

RtuReader::RtuReader(const Settings& settings)
    : SerialReader(settings),
      silence_(settings.rtu_silence),
      partial_timeout_(settings.partial_adu_timeout) {}

void RtuReader::feed(TimePoint now, ByteView bytes) {
    const bool unread = std::exchange(unread_, false);
    if (now - heard_ >= silence_ && !was_silent_ && !unread) framer_.on_silence();
    heard_ = now;
    was_silent_ = false;
    look_at(bytes);
    framer_.feed(bytes);
}

std::optional<ReaderEvent> RtuReader::next(TimePoint now) {
    std::optional<modbus::SerialAdu> adu;
    if (!has_more_to_tell()) adu = framer_.next();
    if (adu) begun_.reset();
    auto event = tell(std::move(adu), framer_.discarded(), framer_.take_faults());
    if (!event && framer_.partial() && !begun_) begun_ = now;
    return event;
}

std::optional<TimePoint> RtuReader::due() const {
    if (!framer_.partial()) return std::nullopt;
    if (!was_silent_) return heard_ + silence_;
    if (!begun_) return std::nullopt;
    return *begun_ + partial_timeout_;
}

void RtuReader::on_due(TimePoint now) {
    if (now - heard_ >= silence_ && !std::exchange(was_silent_, true)) framer_.on_silence();
    if (!begun_ || now - *begun_ < partial_timeout_) return;
    framer_.drop_pending();
    begun_.reset();
}

AsciiReader::AsciiReader(const Settings& settings)
    : SerialReader(settings), framer_(settings.ascii_digits, settings.ascii_pause) {}

void AsciiReader::feed(TimePoint now, ByteView bytes) {
    look_at(bytes);
    framer_.feed(now, bytes);
}

std::optional<ReaderEvent> AsciiReader::next(TimePoint) {
    std::optional<modbus::SerialAdu> adu;
    if (!has_more_to_tell()) adu = framer_.next();
    return tell(std::move(adu), framer_.discarded(), framer_.take_faults());
}

}  // namespace panelgate::tcp_server
