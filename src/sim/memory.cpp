#include "memory.hpp"

#include <string_view>

#include "panelgate/modbus/function.hpp"

namespace panelgate::sim {
namespace {

constexpr std::uint32_t kBitsPerWord = 16;

}  // namespace

Memory::Memory(const profile::PanelProfile& profile) : profile_(&profile) {
    for (const profile::Area& area : profile.areas) {
        if (area.view_of.empty())
            words_[area.name].resize(area.readable.last - area.readable.first + 1);
    }
}

std::uint16_t Memory::get(const profile::Area& area, std::uint32_t address) const {
    if (area.view_of.empty()) return words_.at(area.name)[address - area.readable.first];
    const profile::Area& words = *profile_->find_area(std::string_view(area.view_of));
    const unsigned word = get(words, address / kBitsPerWord);
    return static_cast<std::uint16_t>(word >> (address % kBitsPerWord) & 1u);
}

void Memory::set(const profile::Area& area, std::uint32_t address, std::uint16_t value) {
    if (area.view_of.empty()) {
        const bool bit = modbus::is_bit_table(area.table);
        words_.at(area.name)[address - area.readable.first] =
            bit && value != 0 ? std::uint16_t{1} : value;
        return;
    }
    const profile::Area& words = *profile_->find_area(std::string_view(area.view_of));
    const unsigned mask = 1u << (address % kBitsPerWord);
    const unsigned old = get(words, address / kBitsPerWord);
    set(words, address / kBitsPerWord,
        static_cast<std::uint16_t>(value != 0 ? old | mask : old & ~mask));
}

}  // namespace panelgate::sim
