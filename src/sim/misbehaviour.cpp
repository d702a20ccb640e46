#include "panelgate/sim/misbehaviour.hpp"

#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::sim {

Spoken misbehave(const Misbehaviour& faults, Bytes adu, std::mt19937& chance) {
    const auto happens = [&](double share) {
        return share > 0 && std::uniform_real_distribution<>(0, 1)(chance) < share;
    };
    if (adu.empty() || faults.dead || happens(faults.drop)) return {};
    Spoken spoken{std::move(adu), faults.slow};
    if (happens(faults.late)) spoken.delay += faults.late_by;
    if (happens(faults.foreign_id)) {
        const auto other = static_cast<std::uint8_t>(spoken.adu[0] == 247 ? 1 : spoken.adu[0] + 1);
        spoken.adu =
            modbus::encode_adu(other, ByteView(spoken.adu).subspan(1, spoken.adu.size() - 3));
    }
    if (happens(faults.damage)) {
        std::uniform_int_distribution<std::size_t> place(0, spoken.adu.size() - 1);
        spoken.adu[place(chance)] ^= 0x10;
    }
    if (happens(faults.truncate)) spoken.adu.resize((spoken.adu.size() + 1) / 2);
    return spoken;
}

}  // namespace panelgate::sim
