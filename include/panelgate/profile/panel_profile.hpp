#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::profile {

inline constexpr std::uint32_t kBitsPerWord = 16;  ///< of areas that show bits of registers

/// How a notation writes the bit number.
enum class BitDigits : std::uint8_t {
    none,     ///< the number is the item: UW100, GDT108, 400001
    hex,      ///< decimal word, one hex digit for the bit: UB180 = word 18 bit 0, GR12F
    decimal,  ///< decimal word, '.', two decimal digits: W127.15
};

/// Syntax of an area's notation: PREFIX NUMBER [BIT].
struct Notation {
    std::string prefix;  ///< "UW", "GR", "4"; case-insensitive
    BitDigits bit = BitDigits::none;
    /// Number of the first item: 0 except for reference numbers (400001 is item 0).
    unsigned base = 0;
    /// If not 0, the number has exactly this many digits, with leading zeros (400001: 5); otherwise
    /// leading zeros are ignored (UB00180 = UB180).
    unsigned digits = 0;
    /// Digits of a shorter form that is also accepted (41029 for 401029: 4), 0: none.
    unsigned short_digits = 0;
    friend bool operator==(const Notation&, const Notation&) = default;
};

/// Item addresses [first, last], 0-based as on the wire.
struct AddressRange {
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    bool contains(std::uint32_t address, std::uint32_t count = 1) const {
        return address >= first && count <= last + 1 - address && address <= last;
    }
    friend bool operator==(const AddressRange&, const AddressRange&) = default;
};

/// A part of a panel's memory, named as in the manual.
struct Area {
    std::string name;  ///< "UW"; unique in the profile
    std::string description;
    Notation notation;
    modbus::Table table = modbus::Table::holding_registers;
    /// More tables that show the same memory (GT: GDT also by function 04).
    std::vector<modbus::Table> also;
    AddressRange readable;
    std::optional<AddressRange> writable;
    /// Name of the word area that contains these bits (UB: "UW"): bit n is bit n%16 of word n/16.
    std::string view_of;
    std::string source;  ///< manual and page

    /// True if the functions of this table reach the area.
    bool reaches(modbus::Table other) const {
        return table == other || std::ranges::find(also, other) != also.end();
    }
    friend bool operator==(const Area&, const Area&) = default;
};

struct FunctionRule {
    std::uint8_t code = 0;
    unsigned max_count = 0;  ///< items per request; 0: the standard's limit
    bool broadcast = false;
    std::string source;
    friend bool operator==(const FunctionRule&, const FunctionRule&) = default;
};

/// True if the list contains the value; an empty list allows everything.
template <class T>
bool allows(const std::vector<T>& list, const T& value) {
    return list.empty() || std::ranges::find(list, value) != list.end();
}

struct Serial {
    std::vector<int> baud;  ///< allowed rates
    std::vector<Parity> parity;
    std::vector<int> stop_bits;
    SerialFormat default_format;
    std::string source;
    friend bool operator==(const Serial&, const Serial&) = default;
};

struct Timing {
    double frame_gap_characters = 3.5;  ///< GT: 4
    unsigned max_gap_bits =
        0;  ///< a longer pause inside a request makes the panel ignore it; 0: not given
    std::string source;
    friend bool operator==(const Timing&, const Timing&) = default;
};

struct ExceptionMeaning {
    std::uint8_t code = 0;
    std::string meaning;  ///< in the manual's words
    friend bool operator==(const ExceptionMeaning&, const ExceptionMeaning&) = default;
};

/// A notation that users try but that no function reaches, and the reason.
struct Unreachable {
    std::string prefix;
    std::string reason;
    friend bool operator==(const Unreachable&, const Unreachable&) = default;
};

/// A read that distinguishes this panel from others, for a scanner.
struct Identification {
    Bytes request;      ///< PDU; reads only
    Bytes reply;        ///< beginning of the panel's reply PDU, possibly an exception
    std::string means;  ///< what this reply shows
    std::string source;
    friend bool operator==(const Identification&, const Identification&) = default;
};

/// Initial values of a simulated panel, and which of them change.
struct Simulation {
    struct Cell {
        std::string area;
        std::uint32_t address = 0;
        std::vector<std::uint16_t> values;  ///< consecutive; bits are 0 or 1
        friend bool operator==(const Cell&, const Cell&) = default;
    };
    struct Motion {
        enum class Kind : std::uint8_t { ramp, sine, toggle, clock };
        std::string area;
        std::uint32_t address = 0;
        Kind kind = Kind::ramp;
        double low = 0;
        double high = 100;
        Duration period = 60s;
        friend bool operator==(const Motion&, const Motion&) = default;
    };
    std::vector<Cell> memory;
    std::vector<Motion> motion;
    /// Exception code for a write to a protected part of a readable area: the GP manuals allow
    /// both.
    std::uint8_t protected_exception = 3;
    friend bool operator==(const Simulation&, const Simulation&) = default;
};

/// Data from the manual of a panel family. Data only: config/profiles/NAME.yaml.
struct PanelProfile {
    std::string name;  ///< file name without extension: "autonics-gplp-s"
    std::string description;
    std::string manual;
    std::uint8_t first_station = 1;
    std::uint8_t last_station = modbus::kMaxStation;
    Serial serial;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
    std::vector<FunctionRule> functions;
    std::vector<Area> areas;
    Timing timing;
    std::vector<ExceptionMeaning> exceptions;
    std::vector<Unreachable> unreachable;
    std::vector<Identification> identification;
    Simulation simulation;

    const FunctionRule* find_function(std::uint8_t code) const;
    /// True if the panel supports this function; a profile without functions supports all.
    bool has_function(std::uint8_t code) const {
        return functions.empty() || find_function(code) != nullptr;
    }
    const Area* find_area(std::string_view name) const;
    /// Returns the first area that contains this item of `table`, or nullptr.
    const Area* find_area(modbus::Table table, std::uint32_t address) const;
    /// Returns the maximum items of a request with this function: the profile's or the standard's
    /// limit.
    unsigned max_count(std::uint8_t function) const;
    friend bool operator==(const PanelProfile&, const PanelProfile&) = default;
};

/// A profile with shared ownership of its configuration, which it keeps alive. Without an owner it
/// is a plain pointer.
class ProfileRef {
  public:
    ProfileRef(const PanelProfile* profile = nullptr, std::shared_ptr<const void> owner = {})
        : profile_(std::move(owner), profile) {}

    operator const PanelProfile*() const { return profile_.get(); }
    const PanelProfile& operator*() const { return *profile_; }
    const PanelProfile* operator->() const { return profile_.get(); }
    /// Compares identity: equal profiles of two configurations differ.
    friend bool operator==(const ProfileRef& one, const ProfileRef& other) {
        return one.profile_.get() == other.profile_.get();
    }
    friend bool operator==(const ProfileRef& one, const PanelProfile* other) {
        return one.profile_.get() == other;
    }

  private:
    std::shared_ptr<const PanelProfile> profile_;
};

/// Returns the silence between frames that the panel's manual requires at this rate; 0 in ASCII, as
/// the manuals cover RTU only.
Duration asked_gap(const SerialFormat& serial, const PanelProfile& profile);
/// Returns that or the standard's (silent_interval()), whichever is longer: `frame_gap: auto`.
Duration automatic_gap(const SerialFormat& serial, const PanelProfile& profile);

}  // namespace panelgate::profile
