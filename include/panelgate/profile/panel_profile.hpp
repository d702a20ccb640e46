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

/// How the bit part of a notation is written.
enum class BitDigits : std::uint8_t {
    none,     ///< the number is the item: UW100, GDT108, 400001
    hex,      ///< decimal word, one hex digit for the bit: UB180 = word 18 bit 0, GR12F
    decimal,  ///< decimal word, '.', two decimal digits: W127.15
};

/// The grammar of one area's notation: PREFIX NUMBER [BIT].
struct Notation {
    std::string prefix;  ///< "UW", "GR", "4"; matched without regard to case
    BitDigits bit = BitDigits::none;
    /// What the first item is called: 0 for all but reference numbers (400001 is item 0).
    unsigned base = 0;
    /// When not 0, the number has exactly this many digits, leading zeros included (400001: 5);
    /// otherwise leading zeros are padding (UB00180 = UB180).
    unsigned digits = 0;
    /// A shorter spelling that is also understood (41029 for 401029: 4), 0 = none.
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

/// A piece of a panel's memory as the manual names it.
struct Area {
    std::string name;  ///< "UW"; unique in the profile
    std::string description;
    Notation notation;
    modbus::Table table = modbus::Table::holding_registers;
    /// Further tables whose functions reach the same memory (GT: GDT also by function 04).
    std::vector<modbus::Table> also;
    AddressRange readable;
    std::optional<AddressRange> writable;
    /// Name of the word area whose bits these are (UB: "UW"): bit n is bit n%16 of word n/16.
    std::string view_of;
    std::string source;  ///< manual and page

    /// The functions of this table reach it.
    bool reaches(modbus::Table other) const {
        return table == other || std::ranges::find(also, other) != also.end();
    }
    friend bool operator==(const Area&, const Area&) = default;
};

struct FunctionRule {
    std::uint8_t code = 0;
    unsigned max_count = 0;  ///< items in one request; 0 = the standard's limit
    bool broadcast = false;
    std::string source;
    friend bool operator==(const FunctionRule&, const FunctionRule&) = default;
};

/// A list of what is allowed; an empty one allows everything.
template <class T>
bool allows(const std::vector<T>& list, const T& value) {
    return list.empty() || std::ranges::find(list, value) != list.end();
}

struct Serial {
    std::vector<int> baud;  ///< allowed
    std::vector<Parity> parity;
    std::vector<int> stop_bits;
    SerialFormat default_format;
    std::string source;
    friend bool operator==(const Serial&, const Serial&) = default;
};

struct Timing {
    double frame_gap_characters = 3.5;  ///< GT: 4
    unsigned max_gap_bits =
        0;  ///< the panel ignores a request with a longer pause inside; 0 = not given
    std::string source;
    friend bool operator==(const Timing&, const Timing&) = default;
};

struct ExceptionMeaning {
    std::uint8_t code = 0;
    std::string meaning;  ///< as the manual words it
    friend bool operator==(const ExceptionMeaning&, const ExceptionMeaning&) = default;
};

/// A notation that people try and that no function reaches, and why.
struct Unreachable {
    std::string prefix;
    std::string reason;
    friend bool operator==(const Unreachable&, const Unreachable&) = default;
};

/// A read that tells this panel from others, for a scanner.
struct Identification {
    Bytes request;      ///< PDU; only reads
    Bytes reply;        ///< how the panel's reply PDU begins; an exception counts
    std::string means;  ///< what that shows
    std::string source;
    friend bool operator==(const Identification&, const Identification&) = default;
};

/// Values a simulated panel starts with, and which of them move.
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
    /// What a write into a protected part of a readable area is answered: the GP manuals allow
    /// both.
    std::uint8_t protected_exception = 3;
    friend bool operator==(const Simulation&, const Simulation&) = default;
};

/// What the manual of one panel family says. Data only: config/profiles/NAME.yaml.
struct PanelProfile {
    std::string name;  ///< file name without ending: "autonics-gplp-s"
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
    /// The panel takes this function; a profile that lists none takes all.
    bool has_function(std::uint8_t code) const {
        return functions.empty() || find_function(code) != nullptr;
    }
    const Area* find_area(std::string_view name) const;
    /// The first area that reaches this item through `table`, or nullptr.
    const Area* find_area(modbus::Table table, std::uint32_t address) const;
    /// Items that one request with this function may carry: the profile's or the standard's limit.
    unsigned max_count(std::uint8_t function) const;
    friend bool operator==(const PanelProfile&, const PanelProfile&) = default;
};

/// A profile, and what keeps it: whoever holds this may outlive the configuration that it is of.
/// Without an owner it is a plain pointer.
class ProfileRef {
  public:
    ProfileRef(const PanelProfile* profile = nullptr, std::shared_ptr<const void> owner = {})
        : profile_(std::move(owner), profile) {}

    operator const PanelProfile*() const { return profile_.get(); }
    const PanelProfile& operator*() const { return *profile_; }
    const PanelProfile* operator->() const { return profile_.get(); }
    /// The very same; equal ones of two configurations are not.
    friend bool operator==(const ProfileRef& one, const ProfileRef& other) {
        return one.profile_.get() == other.profile_.get();
    }
    friend bool operator==(const ProfileRef& one, const PanelProfile* other) {
        return one.profile_.get() == other;
    }

  private:
    std::shared_ptr<const PanelProfile> profile_;
};

/// Silence between frames that the panel's manual asks for at this rate; 0 in ASCII, for manuals
/// speak of RTU.
Duration asked_gap(const SerialFormat& serial, const PanelProfile& profile);
/// That or the standard's (silent_interval()), whichever is longer: what `frame_gap: auto` means.
Duration automatic_gap(const SerialFormat& serial, const PanelProfile& profile);

}  // namespace panelgate::profile
