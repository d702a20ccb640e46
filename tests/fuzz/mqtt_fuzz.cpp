#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "panelgate/mqtt/publisher.hpp"

using namespace panelgate;
using namespace panelgate::mqtt;

namespace {

Subjects plant() {
    Subjects subjects;
    subjects.add_line("floor1");
    for (const char* const station : {"press", "oven"}) {
        subjects.add_station(station);
        points::Point point;
        point.name = "level";
        subjects.add_point(point);
        point.type = points::Type::string;
        point.name = "name";
        subjects.add_point(point);
    }
    return subjects;
}

Settings settings(Format format) {
    Settings made;
    made.format = format;
    made.topic = "t";
    made.group = "g";
    made.node = "n";
    made.write = true;
    return made;
}

/// What comes from the broker is a command for a point that there is, or is explained.
void check(const Publisher& publisher, const Command& command) {
    if (const auto* bad = std::get_if<BadCommand>(&command)) {
        if (bad->why.empty()) std::abort();
    } else if (const auto* write = std::get_if<WriteCommand>(&command)) {
        if (write->point >= publisher.subjects().size()) std::abort();
        if (publisher.subjects()[write->point].kind != Subject::Kind::point) std::abort();
        if (publisher.topic_of(write->point).empty()) std::abort();
    }
}

}  // namespace

/// A topic, a line's end, a payload.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Publisher json(settings(Format::json), plant());
    static const Publisher sparkplug(settings(Format::sparkplug), plant());
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const std::size_t end = text.find('\n');
    if (end == text.npos) return 0;
    const std::string_view topic = text.substr(0, end);
    const std::string_view payload = text.substr(end + 1);
    for (const bool retained : {false, true}) {
        for (const Publisher* one : {&json, &sparkplug}) {
            const auto commands = one->commands(topic, payload, retained);
            if (commands.size() > settings(Format::json).metrics) std::abort();
            for (const Command& command : commands) check(*one, command);
        }
    }
    return 0;
}
