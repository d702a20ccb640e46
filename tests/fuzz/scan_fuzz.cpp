#include <cstdlib>
#include <variant>

#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/scan/report.hpp"
#include "panelgate/scan/scanner.hpp"

using namespace panelgate;
using namespace panelgate::scan;

namespace {

constexpr int kMostSteps = 20'000;

/// A line that says what the input says, each time the scanner has sent something or has waited.
class Line {
  public:
    explicit Line(ByteView input) : input_(input) {}

    /// What is heard next, and after which time: a byte each for that, the kind and the length.
    Bytes next(Duration& after) {
        if (input_.size() < 3) return {};
        after = input_[0] * 1ms;
        const std::uint8_t kind = input_[1] % 4;
        const std::size_t length = std::min<std::size_t>(input_[2], input_.size() - 3);
        const ByteView part = input_.subspan(3, length);
        input_ = input_.subspan(3 + length);
        Bytes heard(part.begin(), part.end());
        if (kind == 0 || asked_.empty()) return heard;
        if (kind == 1) return asked_;  // an echo
        if (kind == 2)
            return modbus::encode_adu(asked_[0], heard);  // a good frame of who was asked
        return heard.empty() ? heard : modbus::encode_adu(heard[0], ByteView(heard).subspan(1));
    }
    void sent(const Bytes& adu) { asked_ = adu; }

  private:
    ByteView input_;
    Bytes asked_;
};

/// Only reads may leave.
void act(Scanner& scanner, Line& line) {
    while (const auto action = scanner.poll_action()) {
        const auto* transmit = std::get_if<Transmit>(&*action);
        if (transmit == nullptr) continue;
        if (!modbus::is_pure_read(transmit->request.pdu())) std::abort();
        line.sent(transmit->request.adu());
    }
}

}  // namespace

/// Whatever is heard, and whenever: a scan sends reads only, comes to an end and can be shown.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const profile::Catalogue kProfiles = profile::Catalogue::shipped();
    Settings settings;
    settings.baud = {9600, 38400};
    settings.stations = {1, 5, 31};
    settings.speak_anyway = size % 2 == 1;
    Line line(ByteView(data, size));
    TimePoint now{1h};
    Scanner scanner(kProfiles, settings, now);
    for (int step = 0; !scanner.done(); ++step) {
        if (step > kMostSteps) std::abort();
        act(scanner, line);
        Duration after{};
        const Bytes heard = line.next(after);
        const TimePoint due = *scanner.next_deadline();
        if (!heard.empty() && now + after < due) {
            now += after;
            scanner.on_rx(now, heard);
        } else {
            now = std::max(now, due);
            scanner.on_deadline(now);
        }
        if (scanner.progress().empty()) std::abort();
    }
    if (report_text("/dev/ttyS1", scanner.result()).empty()) std::abort();
    if (report_yaml("/dev/ttyS1", scanner.result()).empty()) std::abort();
    return 0;
}
