#include "mbap_reader.hpp"

#include <utility>
#include <variant>

namespace panelgate::tcp_server {

MbapReader::MbapReader(const Settings& settings)
    : partial_timeout_(settings.partial_adu_timeout),
      bad_protocol_ids_allowed_(settings.bad_protocol_ids) {}

void MbapReader::feed(TimePoint, ByteView bytes) {
    first_.feed(bytes);
    framer_.feed(bytes);
}

std::optional<ReaderEvent> MbapReader::next(TimePoint now) {
    if (auto objection = first_.take_objection()) return std::move(*objection);
    if (std::exchange(late_, false)) return Unusable{"half-sent ADU"};
    auto event = framer_.next();
    if (!event) {
        if (framer_.partial() && !begun_) begun_ = now;
        return std::nullopt;
    }
    begun_.reset();
    if (std::holds_alternative<modbus::Broken>(*event)) return Unusable{"length outside 2..254"};
    if (std::holds_alternative<modbus::SkippedProtocol>(*event)) return on_other_protocol();
    bad_protocol_ids_ = 0;
    first_.on_request();
    return std::get<modbus::Adu>(std::move(*event));
}

/// MBAP-06.
ReaderEvent MbapReader::on_other_protocol() {
    if (++bad_protocol_ids_ >= bad_protocol_ids_allowed_) return Unusable{"protocol id is not 0"};
    return Discarded{};
}

/// An ADU has so long from its first byte to its last (MBAP-07): from when another one begins, or
/// when the rest can be read again after a time without room.
std::optional<TimePoint> MbapReader::due() const {
    if (!begun_) return std::nullopt;
    return *begun_ + partial_timeout_;
}

void MbapReader::on_due(TimePoint now) {
    if (begun_ && now >= *begun_ + partial_timeout_) late_ = true;
}

}  // namespace panelgate::tcp_server
