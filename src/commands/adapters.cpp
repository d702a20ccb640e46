#include "adapters.hpp"

#include <algorithm>
#include <system_error>

#include "table.hpp"

namespace panelgate::commands {

namespace {

namespace fs = std::filesystem;

/// The names in a folder, in their order; none if it cannot be read.
std::vector<fs::path> entries_of(const fs::path& folder) {
    std::vector<fs::path> found;
    std::error_code wrong;
    for (fs::directory_iterator at(folder, wrong); !wrong && at != fs::directory_iterator();
         at.increment(wrong))
        found.push_back(at->path());
    std::ranges::sort(found);
    return found;
}

bool is_usb(const std::string& name) {
    return name.starts_with("ttyUSB") || name.starts_with("ttyACM");
}

}  // namespace

std::vector<Adapter> adapters(const fs::path& dev) {
    std::vector<Adapter> found;
    for (const fs::path& link : entries_of(dev / "serial/by-id")) {
        std::error_code wrong;
        const fs::path device = fs::canonical(link, wrong);
        if (!wrong) found.push_back({link.string(), device.filename().string()});
    }
    const auto linked = found;
    for (const fs::path& device : entries_of(dev)) {
        const std::string name = device.filename().string();
        const bool has_link = std::ranges::find(linked, name, &Adapter::device) != linked.end();
        if (is_usb(name) && !has_link) found.push_back({device.string(), name});
    }
    return found;
}

std::string adapters_text(const std::vector<Adapter>& list) {
    if (list.empty())
        return "  no USB adapter is here (/dev/serial/by-id, /dev/ttyUSB*, /dev/ttyACM*): is it "
               "plugged in? Others are /dev/ttyS* and tcp://HOST:PORT\n";
    std::string text = "  USB adapters that are here:\n";
    for (const Adapter& adapter : list) {
        const bool is_link = !adapter.name.ends_with('/' + adapter.device);
        text += "    " + printable(adapter.name) +
                (is_link ? "  (" + printable(adapter.device) + ')' : "") + '\n';
    }
    return text;
}

}  // namespace panelgate::commands
