#include "draft.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "panelgate/base/text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::imports {

namespace {

/// "Zone 1.Temp" becomes "zone-1-temp"; "" without a letter or digit.
std::string name_of(std::string_view text) {
    std::string name;
    for (const char c : text) {
        const char lower = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
        const bool fits =
            (lower >= 'a' && lower <= 'z') || (lower >= '0' && lower <= '9') || lower == '_';
        if (fits)
            name += lower;
        else if (!name.empty() && name.back() != '-')
            name += '-';
    }
    while (name.ends_with('-')) name.pop_back();
    return name;
}

/// A name that none of `taken` is yet.
std::string unique(const std::string& wanted, std::set<std::string>& taken) {
    std::string name = wanted;
    for (int i = 2; !taken.insert(name).second; ++i) name = wanted + '-' + std::to_string(i);
    return name;
}

std::string text_of(const std::string& name, const points::Point& point) {
    std::string text = "{name: " + name + ", at: \"" + point.at + '"';
    const auto add = [&](std::string_view key, const std::string& value) {
        text += ", " + std::string(key) + ": " + value;
    };
    if (point.bit) add("bit", std::to_string(*point.bit));
    if (point.type != points::Type::boolean && point.type != points::Type::u16)
        add("type", std::string(label(point.type)));
    if (point.type == points::Type::string) add("length", std::to_string(point.length));
    if (point.word_order != points::WordOrder::abcd)
        add("word_order", std::string(label(point.word_order)));
    if (point.scale != 1) add("scale", number_text(point.scale));
    if (point.offset != 0) add("offset", number_text(point.offset));
    if (!point.unit.empty()) add("unit", yaml::written(point.unit));
    if (point.writable) add("writable", "true");
    if (point.every != 1s) add("every", yaml::format_duration(point.every));
    return text + '}';
}

}  // namespace

std::string notation(modbus::Table table, std::int64_t address) {
    constexpr std::array<char, 4> kDigits{'0', '1', '3', '4'};  // in the order of modbus::Table
    const std::string number = std::to_string(address + 1);
    return kDigits.at(static_cast<std::size_t>(table)) +
           std::string(5 - std::min<std::size_t>(number.size(), 5), '0') + number;
}

std::string serial_map(const std::string& baud, const std::string& data_bits,
                       std::string_view parity, const std::string& stop_bits, bool ascii) {
    const std::string_view word = parity == "E" ? "even" : parity == "O" ? "odd" : "none";
    return "{baud: " + baud + ", data_bits: " + data_bits + ", parity: " + std::string(word) +
           ", stop_bits: " + stop_bits + (ascii ? ", mode: ascii}" : "}");
}

std::size_t Draft::line(const std::string& name, const std::string& device,
                        const std::string& serial) {
    const auto known = std::ranges::find(lines_, device, &Line::device);
    if (known != lines_.end()) return static_cast<std::size_t>(known - lines_.begin());
    std::set<std::string> taken;
    for (const Line& one : lines_) taken.insert(one.name);
    const std::string wanted = name_of(name);
    lines_.push_back({unique(wanted.empty() ? "line" : wanted, taken), device, serial});
    return lines_.size() - 1;
}

void Draft::add(std::size_t line, std::int64_t station, const Tag& tag) {
    Line& to = lines_[line];
    const std::string wanted = name_of(tag.name);
    const std::string name = unique(wanted.empty() ? "point" : wanted, to.names[station]);
    to.stations[station].push_back(text_of(name, tag.point));
}

void Draft::note(int line, const std::string& what) {
    notes_.push_back(file_ + ':' + std::to_string(line) + ": " + what);
}

Imported Draft::made() const {
    Imported made;
    made.notes = notes_;
    made.yaml = "# Made of " + file_ + ", a file of " + program_ + ".\n";
    for (const std::string& note : notes_) made.yaml += "# not taken over: " + note + '\n';
    made.yaml += "lines:\n";
    std::string units;
    int unit = 0;
    for (const Line& line : lines_) {
        made.yaml += "  - name: " + line.name + "\n    device: " + line.device + '\n';
        if (!line.serial.empty()) made.yaml += "    serial: " + line.serial + '\n';
        made.yaml += "    stations:\n";
        for (const auto& [id, points] : line.stations) {
            const std::string number = std::to_string(id);
            units += (units.empty() ? "" : ", ") + std::to_string(++unit) + ": " + line.name + '/' +
                     number;
            made.yaml += "      - id: " + number + "\n        name: " + line.name + '-' + number +
                         "\n        points:\n";
            for (const std::string& point : points) made.yaml += "          - " + point + '\n';
        }
    }
    made.yaml += "modbus_tcp:\n  - listen: 127.0.0.1:1502\n";
    if (lines_.size() > 1) made.yaml += "    units: {" + units + "}\n";
    made.yaml += "http: {listen: 127.0.0.1:8080}\n";
    return made;
}

std::optional<Imported> import_tags(std::string_view text, yaml::Problems& problems,
                                    bool& is_known) {
    const auto has = [text](std::string_view sign) { return text.find(sign) != text.npos; };
    is_known = true;
    if (has("[[inputs.modbus")) return import_telegraf(text, problems);
    if (text.substr(0, text.find('\n')).find("Tag Name") != text.npos)
        return import_kepware(text, problems);
    const bool is_yaml = text.starts_with("modbus:") || has("\nmodbus:");
    if (is_yaml && !has("metricType:")) return import_home_assistant(text, problems);
    is_known = false;
    return std::nullopt;
}

}  // namespace panelgate::imports
