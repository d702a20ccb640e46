// Serial ports, of lines and of masters: their rows, and what two of their keys say together.

#include <string>
#include <string_view>
#include <vector>

#include "hints.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/settings.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::Node;

/// RTU has 8, ASCII normally 7, and 8 on some panels (serial line V1.02, 2.5.1, 2.5.2).
bool read_data_bits(Reader& in, SerialFormat& format) {
    const bool ascii = format.mode == SerialMode::ascii;
    const yaml::Node* typed = in.child("data_bits");
    if (!ascii && typed != nullptr && typed->scalar == "7") {
        in.problem("data_bits", "RTU needs 8 data bits; 7 is for ASCII mode");
        return false;
    }
    const auto bits = in.integer("data_bits", ascii ? 7 : 8, 8);
    format.data_bits = static_cast<int>(bits.value_or(ascii ? 7 : 8));
    return bits.has_value();
}

/// A master has its protocol elsewhere.
void read_port_serial(Reader& in, SerialFormat& format) {
    const bool given = in.refuse("mode",
                                 "is a serial master's framing: write framing: ascii beside "
                                 "serial, or leave it out for RTU");
    if (given) format.mode = SerialMode::ascii;  // takes 7 and 8 data bits
    serial_keys().read(in, format);
}

void check_whole(Reader& in, std::string_view key, Duration delay) {
    if (delay % 1ms == Duration::zero()) return;
    in.problem(key, std::string(key) + " must be whole milliseconds in rs485 mode kernel, not " +
                        yaml::format_duration(delay));
}

}  // namespace

bool read_serial(Reader& owner, const std::function<void(Reader&)>& read) {
    const std::size_t before = owner.problems().list().size();
    if (const Node* node = owner.map("serial", serial_example(owner.child("serial")))) {
        Reader in(owner.loading, *node, "serial");
        read(in);
        in.finish();
    }
    return owner.problems().list().size() == before;
}

void check_rs485(Reader& in, const line::Rs485& rs485) {
    using Mode = line::Rs485::Mode;
    if (rs485.mode == Mode::kernel) {
        check_whole(in, "delay_before_send", rs485.delay_before_send);
        check_whole(in, "delay_after_send", rs485.delay_after_send);
    }
    if (rs485.receive_during_send && rs485.mode == Mode::rts)
        in.problem("receive_during_send",
                   "receive_during_send belongs to rs485 mode kernel: with rts the adapter's "
                   "wiring decides it");
}

void check_path(Reader& in, const std::string& path) {
    const std::size_t end = path.find_first_of(":,; \t");
    if (!path.starts_with("/dev/tty") || end == path.npos) return;
    Node behind;
    behind.scalar = path.substr(end);
    const bool more = behind.scalar.find_first_of("0123456789") != behind.scalar.npos;
    in.problem("device",
               "device must be a path alone, not " + yaml::quote(path) + "; write " +
                   path.substr(0, end) +
                   (more ? ", and what is behind it as serial: " + serial_example(&behind) : ""));
}

const Keys<line::Settings>& port_keys() {
    using Port = line::Settings;
    static const auto kKeys =
        Keys<Port>()
            .value(
                text_shape("device", {"^/", false}, "Serial port that the master is connected to."),
                [](Reader& in, Port& port) {
                    port.device = in.text("device").value_or("");
                    if (port.device.starts_with('/')) return check_path(in, port.device), true;
                    if (port.device.empty()) return false;
                    in.problem("device",
                               "device must be a serial device such as /dev/ttyUSB1, not " +
                                   yaml::quote(port.device) +
                                   (port.device.starts_with("tcp://")
                                        ? "; a master's silences do not come through a network"
                                        : device_hint(port.device)));
                    return false;
                },
                [](const Port& port) { return port.device; })
            .required()
            .example("/dev/ttyUSB1")
            .change_needs(kOpensPort)
            .below(
                shape_of("serial", Kind::map, "Character format."),
                []() -> const Table& { return serial_keys(); },
                [](Reader& in, Port& port) {
                    read_serial(in, [&](Reader& serial) { read_port_serial(serial, port.serial); });
                    return in.has("serial");
                },
                [](const SettingWriter& out, const Port& port, const SettingWriter*) {
                    serial_keys().show(out.below("serial"), port.serial);
                })
            .change_needs(kOpensPort)
            .map("rs485", &Port::rs485, rs485_keys, "{mode: off}", kRs485,
                 [](Reader& in, Port& port) { check_rs485(in, port.rs485); })
            .change_needs(kOpensPort);
    return kKeys;
}

const Keys<SerialFormat>& serial_keys() {
    using Format = SerialFormat;
    static const auto kKeys =
        Keys<Format>()
            .integer("baud", &Format::baud, 50, 4'000'000, "Bits per second.")
            .example("38400")
            .value(integers("data_bits", 7, 8,
                            "Data bits of a character: 8 in RTU; 7 or 8 in ASCII, where 7 is the "
                            "default."),
                   read_data_bits,
                   [](const Format& format) { return std::to_string(format.data_bits); })
            .initially("")
            .word("parity", &Format::parity, kParityWords, "Parity of each character.")
            .example("none")
            .integer("stop_bits", &Format::stop_bits, 1, 2, "Stop bits of each character.");
    return kKeys;
}

const Keys<line::Rs485>& rs485_keys() {
    using line::Rs485;
    using Mode = Rs485::Mode;
    static constexpr Words<Mode, 3> kModes{
        {{"off", Mode::off}, {"kernel", Mode::kernel}, {"rts", Mode::rts}}};
    static constexpr Words<bool, 2> kLevels{{{"high", true}, {"low", false}}};
    static const std::vector<std::string> kSwitched{"kernel", "rts"};
    constexpr std::string_view kWhy = "belongs to rs485 mode kernel or rts";
    // 0 to 100 ms, as the kernel accepts
    static const auto kKeys =
        Keys<Rs485>()
            .word("mode", &Rs485::mode, kModes,
                  "off: the adapter by itself; kernel: its driver (TIOCSRS485); rts: this "
                  "program, as well as timers allow.")
            .example("off")
            .word("rts_on_send", &Rs485::rts_high_on_send, kLevels, "Level of RTS while sending.")
            .only_with("mode", kSwitched, kWhy)
            .duration("delay_before_send", &Rs485::delay_before_send, 0ms, 100ms,
                      "Delay from RTS to the first bit; with mode kernel of whole milliseconds.")
            .only_with("mode", kSwitched, kWhy)
            .duration("delay_after_send", &Rs485::delay_after_send, 0ms, 100ms,
                      "Delay from the last bit to the release of RTS; with mode kernel of whole "
                      "milliseconds.")
            .only_with("mode", kSwitched, kWhy)
            .boolean("receive_during_send", &Rs485::receive_during_send,
                     "The receiver stays on while sending; with mode kernel.")
            .only_with("mode", kSwitched, kWhy);
    return kKeys;
}

}  // namespace panelgate::config
