#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"

namespace panelgate::modbus {

/// Function codes of the Application Protocol V1.1b3, section 6.
enum Function : std::uint8_t {
    kReadCoils = 0x01,
    kReadDiscreteInputs = 0x02,
    kReadHoldingRegisters = 0x03,
    kReadInputRegisters = 0x04,
    kWriteSingleCoil = 0x05,
    kWriteSingleRegister = 0x06,
    kReadExceptionStatus = 0x07,
    kDiagnostics = 0x08,
    kGetCommEventCounter = 0x0B,
    kGetCommEventLog = 0x0C,
    kWriteMultipleCoils = 0x0F,
    kWriteMultipleRegisters = 0x10,
    kReportServerId = 0x11,
    kReadFileRecord = 0x14,
    kWriteFileRecord = 0x15,
    kMaskWriteRegister = 0x16,
    kReadWriteMultipleRegisters = 0x17,
    kReadFifoQueue = 0x18,
    kEncapsulatedInterface = 0x2B,
};
inline constexpr std::uint8_t kExceptionBit = 0x80;
/// Returns the function code without the exception bit.
constexpr std::uint8_t plain_function(std::uint8_t function) {
    return static_cast<std::uint8_t>(function & ~kExceptionBit);
}
inline constexpr std::uint8_t kMeiDeviceIdentification = 0x0E;

inline constexpr std::size_t kMaxPdu = 253;     ///< AP 4.1
inline constexpr std::size_t kMaxRtuAdu = 256;  ///< AP 4.1: address + PDU + CRC
/// Longest reply of the Panasonic GT: one byte of byte count, so 255 data bytes (ARCT1F501E,
/// 1.3.1).
inline constexpr std::size_t kMaxLongRtuAdu = 260;
/// Longest write to it (ARCT1F501E gives no limit, the byte count does): 0F with 255 data bytes.
inline constexpr std::size_t kMaxLongRequestPdu = 261;
inline constexpr std::uint8_t kMaxStation = 247;  ///< serial line V1.02, 2.2
/// The standard reserves 248 to 255. Devices use these addresses all the same (modbus-tk#6,
/// minimalmodbus#101, mbpoll#75): a station there is asked if the configuration lists it.
inline constexpr std::uint8_t kMaxListedStation = 255;

/// The four tables of the data model (AP 4.3).
enum class Table : std::uint8_t { coils, discrete_inputs, input_registers, holding_registers };
inline constexpr std::array kTables = {Table::coils, Table::discrete_inputs, Table::input_registers,
                                       Table::holding_registers};
/// Returns the word of the REST path: "holding-registers".
std::string_view label(Table table);
inline constexpr bool is_bit_table(Table table) {
    return table == Table::coils || table == Table::discrete_inputs;
}
Function read_function(Table table);

/// True for 01 to 04, the reads of the four tables.
inline constexpr bool reads_table(std::uint8_t function) {
    return function >= kReadCoils && function <= kReadInputRegisters;
}
/// True for pure reads, which may be repeated without harm (RTY-02: 01..04, 07, 0B, 0C, 11, 14,
/// 18). 2B is one only with MEI type 0E; see is_pure_read(pdu) in request.hpp.
bool is_read(std::uint8_t function);
/// True for 05, 06, 0F, 10: functions that may be broadcast (BC-02).
bool is_broadcastable(std::uint8_t function);
/// Returns the name, "read coils"; "" if the standard does not define the function.
std::string_view function_name(std::uint8_t function);
/// True if the standard defines it (AP section 6): keeps vendors' codes out of metric labels.
bool is_known(std::uint8_t function);

/// Exception codes of AP section 7. Any other byte is vendor-specific and passes through unchanged.
enum class ExceptionCode : std::uint8_t {
    illegal_function = 0x01,
    illegal_data_address = 0x02,
    illegal_data_value = 0x03,
    server_device_failure = 0x04,
    acknowledge = 0x05,
    server_device_busy = 0x06,
    memory_parity_error = 0x08,
    gateway_path_unavailable = 0x0A,
    gateway_target_failed = 0x0B,
};

/// Returns "illegal data address"; "exception 9" for codes without a name.
std::string describe_exception(std::uint8_t code);

/// Exception code for the client: 01 denied; 03 malformed; 06 busy, expired; 0A not routed, line
/// down, cancelled (the gateway is stopping); 0B if the request may have been executed, or the
/// station is offline.
ExceptionCode to_exception(Fault fault);

/// Encodes {function | 80h, code}.
Bytes encode_exception(std::uint8_t function, ExceptionCode code);
/// Returns the code if `pdu` is an exception reply (two bytes, high bit set).
std::optional<std::uint8_t> exception_of(ByteView pdu);

inline constexpr std::uint32_t kTableItems = 65536;  ///< of each table (AP 4.3)

/// Items [first, end()) of one table, 0-based as on the wire. Callers that need it check that end()
/// is within kTableItems.
struct Span {
    Table table = Table::holding_registers;
    std::uint32_t first = 0;
    std::uint32_t count = 1;

    std::uint32_t end() const { return first + count; }  ///< one past the last item
    bool contains(const Span& other) const {
        return table == other.table && first <= other.first && other.end() <= end();
    }
    bool overlaps(const Span& other) const {
        return table == other.table && first < other.end() && other.first < end();
    }
    /// True if they overlap or are adjacent: together they are one span without a gap.
    bool touches(const Span& other) const {
        return table == other.table && other.first <= end() && first <= other.end();
    }
    friend bool operator==(const Span&, const Span&) = default;
};

/// Returns the smallest span that contains both, which must be of one table.
inline Span join(const Span& a, const Span& b) {
    const std::uint32_t first = std::min(a.first, b.first);
    return {a.table, first, std::max(a.end(), b.end()) - first};
}

}  // namespace panelgate::modbus
