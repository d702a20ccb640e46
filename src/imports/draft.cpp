#include "draft.hpp"

#include <algorithm>
#include <array>

#include "panelgate/base/text.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::imports {

namespace {

using points::Type;
using points::WordOrder;

/// "Zone 1.Temp" becomes "zone-1-temp", `otherwise` without a letter or digit. `kept`: '_', where
/// names may have it.
std::string name_of(std::string_view text, char kept, const std::string& otherwise) {
    std::string name;
    for (const char c : to_lower(text)) {
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == kept)
            name += c;
        else if (!name.empty() && name.back() != '-')
            name += '-';
    }
    while (name.ends_with('-')) name.pop_back();
    return name.empty() ? otherwise : name;
}

/// A name that none of `taken` is yet.
std::string unique(const std::string& wanted, std::set<std::string>& taken) {
    std::string name = wanted;
    for (int i = 2; !taken.insert(name).second; ++i) name = wanted + '-' + std::to_string(i);
    return name;
}

/// In quotes where YAML has a number, a boolean or a null.
std::string as_text(const std::string& name) {
    static const std::set<std::string> kWords{"null", "true", "false", "yes", "no",
                                              "on",   "off",  "y",     "n"};
    const bool plain = name[0] >= 'a' && name[0] <= 'z' && !kWords.contains(name);
    return plain ? name : '\'' + name + '\'';
}

/// "400001" of the first holding register
std::string notation(modbus::Table table, std::int64_t address) {
    constexpr std::array<char, 4> kDigits{'0', '1', '3', '4'};  // in the order of modbus::Table
    const std::string number = std::to_string(address + 1);
    return kDigits.at(static_cast<std::size_t>(table)) +
           std::string(5 - std::min<std::size_t>(number.size(), 5), '0') + number;
}

/// The order that matters: one register and strings only have their bytes turned.
WordOrder useful_order(const points::Point& point) {
    if (points::registers_of(point.type) > 1 && point.type != Type::string) return point.word_order;
    const bool turns = point.word_order == WordOrder::badc || point.word_order == WordOrder::dcba;
    return turns && point.type != Type::boolean ? WordOrder::badc : WordOrder::abcd;
}

std::string text_of_point(const std::string& name, const Tag& tag) {
    const points::Point& point = tag.point;
    std::string text =
        "{name: " + as_text(name) + ", at: \"" + notation(point.table, tag.address) + '"';
    const auto add = [&](std::string_view key, const std::string& value) {
        text += ", " + std::string(key) + ": " + value;
    };
    if (point.bit) add("bit", std::to_string(*point.bit));
    if (point.type != Type::boolean && point.type != Type::u16)
        add("type", std::string(label(point.type)));
    if (point.type == Type::string) add("length", std::to_string(point.length));
    if (const WordOrder order = useful_order(point); order != WordOrder::abcd)
        add("word_order", std::string(label(order)));
    if (point.scale != 1) add("scale", number_text(point.scale));
    if (point.offset != 0) add("offset", number_text(point.offset));
    std::string unit = point.unit;
    std::ranges::replace_if(unit, is_control, ' ');
    if (!unit.empty()) add("unit", yaml::written(unit));
    if (!point.no_value.empty())
        add("no_value", '[' + std::to_string(point.no_value.front()) + ']');
    if (point.writable) add("writable", "true");
    if (point.every != 1s) add("every", yaml::format_duration(point.every));
    return text + '}';
}

}  // namespace

Draft::Draft(std::string program, const std::string& file)
    : program_(std::move(program)), file_(printable(file)) {}

std::optional<std::int64_t> Draft::line(const LineBody& body) {
    const auto known = std::ranges::find(lines_, body.device, &LineBody::device);
    const std::int64_t index = known - lines_.begin();
    if (known == lines_.end()) {
        std::set<std::string> taken;
        for (const LineBody& one : lines_) taken.insert(one.name);
        lines_.push_back(body);
        std::string& name = lines_.back().name;
        name = unique(name_of(name, '-', "line"), taken);
        rows_[{index, 0, 0}] = {
            "  - name: " + as_text(name) + "\n    device: " + yaml::written(body.device) + '\n' +
                (body.serial.empty() ? "" : "    serial: " + body.serial + '\n'),
            body.line, body.name};
        rows_[{index, 0, 3}] = {"    stations:\n", body.line, body.name};
    } else if (known->serial != body.serial) {
        return std::nullopt;
    }
    for (const auto& [key, value] : body.waits) {
        const Row row{"    " + key + ": " + value + '\n', body.line, body.name};
        const auto [old, added] = rows_.try_emplace({index, 0, key == "timing" ? 1 : 2}, row);
        if (old->second.text != row.text)
            note(body.line, body.name + ": " + key + ' ' + value + ", as its line has another");
    }
    return index;
}

void Draft::add(std::int64_t line, std::int64_t station, Tag tag) {
    points::Point& point = tag.point;
    const auto refuse = [&](const std::string& why) { note(tag.line, tag.name + ": " + why); };
    if (station < 1 || station > modbus::kMaxListedStation)
        return refuse("station " + std::to_string(station));
    if (tag.address < 0 || tag.address > 0xFFFF)
        return refuse("address " + std::to_string(tag.address));
    auto& names = names_[{line, station}];
    if (names.size() == points::kMaxPoints)
        return refuse("the station has " + std::to_string(points::kMaxPoints) + " points already");
    if (point.writable && (point.table == modbus::Table::discrete_inputs ||
                           point.table == modbus::Table::input_registers)) {
        refuse("writes, as its table is read only");
        point.writable = false;
    }
    if (point.every < 1ms || point.every > points::kSlowest) {
        refuse("its interval; it is read every 24 h");
        point.every = points::kSlowest;
    }
    const std::string name = unique(name_of(tag.name, '_', "point"), names);
    const std::string id = std::to_string(station);
    const std::string& owner = lines_[static_cast<std::size_t>(line)].name;
    rows_.try_emplace({line, station, 0}, Row{"      - id: " + id + "\n        name: " +
                                                  as_text(owner + '-' + id) + "\n        points:\n",
                                              tag.line, owner + '/' + id});
    rows_[{line, station, static_cast<std::int64_t>(names.size())}] = {
        "          - " + text_of_point(name, tag) + '\n', tag.line, tag.name};
}

void Draft::left_over(int line, const std::string& kind, const std::string& place,
                      const std::string& key) {
    ++left_.try_emplace({kind, key}, Left{line, place}).first->second.count;
}

/// Erases a row; the row of a head with all rows below.
void Draft::erase(Key key) {
    Key end = key;
    ++end[key[2] != 0 ? 2 : key[1] != 0 ? 1 : 0];
    rows_.erase(rows_.lower_bound(key), rows_.lower_bound(end));
}

/// Removes stations without a point or a unit id, and lines without a station.
void Draft::tidy() {
    std::set<std::int64_t> lines;
    int units = 0;
    for (const auto& [owner, names] : names_) {
        const Key head{owner.first, owner.second, 0};
        const auto row = rows_.find(head);
        if (row == rows_.end()) continue;
        const auto next = std::next(row);
        const bool has_point =
            next != rows_.end() && next->first[0] == head[0] && next->first[1] == head[1];
        if (has_point && ++units > modbus::kMaxListedStation)
            note(row->second.line, row->second.what + ": no unit id is left for this station");
        if (has_point && units <= modbus::kMaxListedStation)
            lines.insert(head[0]);
        else
            erase(head);
    }
    std::erase_if(rows_, [&](const auto& row) { return !lines.contains(row.first[0]); });
}

std::string Draft::text() const {
    std::string text = "lines:\n";
    std::string units;
    int unit = 1;
    for (const auto& [key, row] : rows_) {
        text += row.text;
        if (key[1] > 0 && key[2] == 0) units += std::to_string(unit++) + ": " + row.what + ", ";
    }
    text += "modbus_tcp:\n  - listen: 127.0.0.1:1502\n";
    if (!rows_.empty() && rows_.begin()->first[0] != rows_.rbegin()->first[0])
        text += "    units: {" + units.substr(0, units.size() - 2) + "}\n";
    return text + "http: {listen: 127.0.0.1:8080}\n";
}

/// Removes what has faults; false if nothing of the file has any.
bool Draft::drop(const std::vector<yaml::Problem>& faults) {
    std::vector<Key> origins{{-1}};  // of the lines of the text
    for (const auto& [key, row] : rows_)
        origins.insert(origins.end(), static_cast<std::size_t>(std::ranges::count(row.text, '\n')),
                       key);
    bool dropped = false;
    for (const yaml::Problem& fault : faults) {
        const auto at = static_cast<std::size_t>(fault.mark.line) - 1;
        const auto row = at < origins.size() ? rows_.find(origins[at]) : rows_.end();
        if (row == rows_.end()) continue;
        note(row->second.line, row->second.what + ": " + fault.message);
        erase(origins[at]);
        dropped = true;
    }
    return dropped;
}

std::optional<Imported> Draft::made(const Check& check, yaml::Problems& problems) {
    constexpr int kRounds = 20;  // a fault may hide another one
    std::vector<yaml::Problem> faults;
    for (int round = 0; round < kRounds; ++round) {
        tidy();
        faults = check && !rows_.empty() ? check(text()) : std::vector<yaml::Problem>();
        if (faults.empty() || !drop(faults)) break;
    }
    for (const auto& [key, left] : left_)
        note(left.line,
             left.place + ": " + key.second +
                 (left.count == 1 ? "" : " (and of " + std::to_string(left.count - 1) + " more)"));
    if (rows_.empty()) {
        problems.add({1, 1}, "there is no tag here that can be taken over");
        for (const auto& [line, what] : notes_)
            problems.add({line, 1}, "not taken over: " + printable(what));
    } else {
        for (const yaml::Problem& fault : faults) problems.add({1, 1}, fault.message);
    }
    if (!problems.empty()) return std::nullopt;
    Imported made{"# Made of " + file_ + ", a file of " + program_ + ".\n", {}};
    for (const auto& [line, what] : notes_) {
        made.notes.push_back(file_ + ':' + std::to_string(line) + ": " + printable(what));
        made.yaml += "# not taken over: " + made.notes.back() + '\n';
    }
    made.yaml += text();
    return made;
}

std::optional<Imported> import_tags(std::string_view text, yaml::Problems& problems, bool& is_known,
                                    const Check& check) {
    using Read = void (*)(std::string_view, yaml::Problems&, Draft&);
    const auto has = [text](std::string_view sign) { return text.find(sign) != text.npos; };
    const auto import = [&](const std::string& program, Read read) {
        Draft draft(program, problems.file());
        read(text, problems, draft);
        return problems.empty() ? draft.made(check, problems) : std::nullopt;
    };
    is_known = true;
    if (has("[[inputs.modbus")) return import("Telegraf", read_telegraf);
    if (text.substr(0, text.find('\n')).find("Tag Name") != text.npos)
        return import("Kepware", read_kepware);
    const bool is_yaml = text.starts_with("modbus:") || has("\nmodbus:");
    if (is_yaml && !has("metricType:")) return import("Home Assistant", read_home_assistant);
    is_known = false;
    return std::nullopt;
}

}  // namespace panelgate::imports
