#include "panelgate/arbiter/questions.hpp"

#include <algorithm>

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

void Questions::on_heard(TimePoint now, ByteView bytes) {
    const ByteView adu = bytes.first(modbus::request_adu_length(bytes));
    if (adu.size() <= modbus::kAduOverhead || adu[0] == kBroadcast) return;
    if (asked_.size() == kMost) asked_.erase(asked_.begin());
    asked_.push_back({now, Bytes(adu.begin(), adu.end())});
}

bool Questions::fit(ByteView adu, TimePoint since) const {
    return std::ranges::any_of(asked_, [&](const Question& asked) {
        return asked.at >= since && asked.adu[0] == adu[0] &&
               modbus::answers(modbus::pdu_of(asked.adu), modbus::pdu_of(adu));
    });
}

}  // namespace panelgate::arbiter
