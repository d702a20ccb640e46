#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/config/describe.hpp"
#include "panelgate/explain/difference.hpp"
#include "panelgate/explain/inventory.hpp"
#include "panelgate/gateway/running_line.hpp"
#include "panelgate/tls/issue.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "support/yaml_text.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::explain::every_key_test {
namespace {

namespace fs = std::filesystem;

const fs::path kGeneric = fs::path(SOURCE_ROOT) / "config/profiles/generic.yaml";

std::string text_of(const fs::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

config::MemoryFiles all_files() {
    const tls::Issued ca = tls::issue_ca("CA", {0, 1});
    const tls::Issued gateway = tls::issue_server(ca, {"gateway"}, {0, 1});
    std::map<std::string, std::string> texts{{"/run/secrets/ops", "secret-0123456789"},
                                             {"/run/secrets/other", "other-0123456789"},
                                             {"/run/secrets/two", "second-0123456789"},
                                             {"/points/a.csv", "name,at\nq,400005\n"},
                                             {"/points/b.csv", "name,at\nq,400005\nr,400006\n"},
                                             {"/profiles/own.yaml", text_of(kGeneric)}};
    for (const std::string name : {"/tls/a", "/tls/b"}) {
        texts[name + ".crt"] = gateway.certificate;
        texts[name + ".key"] = gateway.key;
        texts[name + "-ca.crt"] = ca.certificate;
        texts[name + ".crl"] = tls::revoke(ca, "", gateway.certificate, {0, 1});
    }
    return config::MemoryFiles(std::move(texts));
}

const config::MemoryFiles& files() {
    static const config::MemoryFiles kFiles = all_files();
    return kFiles;
}

std::optional<config::Config> load(const std::string& text) {
    yaml::Problems problems("x.yaml");
    return config::load(text, files(), problems);
}

/// One of each map, in which any key may be left out or have its default.
constexpr const char* kPlain = R"(lines:
  - name: a
    device: /dev/ttyS1
    serial: {parity: odd}
    rs485: {mode: rts}
    timing: {broadcast_turnaround: 90ms}
    queue: {deadline: 1s}
    offline: {after: 2}
    simulate: {echo: true}
    stations:
      - id: 1
        simulate: {dead: true}
        poll: [{read: "400001"}]
        points: [{name: p, at: "400001", type: u32}]
modbus_tcp: [{listen: "127.0.0.1:502", framing: tcp}, {listen: "127.0.0.1:503"},
  {listen: "127.0.0.1:802", tls: {certificate: /tls/a.crt, key: /tls/a.key}}]
serial_masters:
  - {name: plc, device: /dev/ttyS2, serial: {parity: odd}, rs485: {mode: rts}}
http: {anonymous: none, tls: {certificate: /tls/a.crt, key: /tls/a.key}}
mqtt: {broker: "mqtt://b:1883", topic: x, format: json}
relays: [{from: a-1/400001, to: a-1/400101, on_change: true}]
log: {level: warn, format: json}
realtime: {priority: 20, lock_memory: true}
access: {rules: [{name: no, deny: [write], range: {table: coils, address: 1}}]}
)";

/// Has what every_key.yaml has in only one way, or not at all.
constexpr const char* kFurther = R"(lines:
  - name: a
    device: /dev/ttyS1
    serial: {mode: ascii, data_bits: 7, ascii_lower_case: take}
    rs485: {mode: kernel, rts_on_send: high, delay_before_send: 1ms, delay_after_send: 1ms,
            receive_during_send: false}
    timing: {response_timeout: adaptive, adaptive_floor: 20ms, adaptive_ceiling: 600ms}
    simulate: {echo: true}
    stations:
      - id: 1
        points_file: /points/a.csv
        timing: {response_timeout: adaptive, adaptive_floor: 30ms, adaptive_ceiling: 700ms,
                 frame_gap: auto, late_window: auto, think_time: 2ms, station_gap: 20ms,
                 after_write: 1s}
        simulate: {dead: false, slow: 1ms, late_by: 1ms, late: 0.1, drop: 0.1, damage: 0.1,
                   truncate: 0.1, foreign_id: 0.1, duplicate: 0.1}
      - {id: 2, access: read_write, profile: generic, any_length: true}
  - name: b
    device: /dev/ttyS7
    mode: listen
    serial: {baud: 9600, data_bits: 8, parity: none, stop_bits: 1}
  - {name: c, device: /dev/ttyS8, serial: {mode: rtu}}
  - {name: d, device: "tcp://10.0.0.1:4001", connect_pause: 1s}
  - {name: e, device: "modbus-tcp://10.0.0.1:802", in_flight: 4,
     tls: {ca: /tls/a-ca.crt, certificate: /tls/a.crt, key: /tls/a.key}}
modbus_tcp:
  - {listen: "127.0.0.1:502", lines: [a], framing: ascii, ascii_lower_case: take, broadcast: silent}
  - {listen: "127.0.0.1:503", retransmissions: join, units: {101: a/1, 102: a/1}}
  - {listen: "127.0.0.1:504", framing: rtu, broadcast: silent}
  - {listen: "127.0.0.1:802", tls: {certificate: /tls/a.crt, key: /tls/a.key, ca: /tls/a-ca.crt,
     client: required, crl: /tls/a.crl, min_version: TLSv1.2}}
serial_masters:
  - {name: plc, device: /dev/ttyS2, lines: [a], units: {7: a/1}, access: read_write, framing: ascii,
     serial: {baud: 9600, data_bits: 7, parity: none, stop_bits: 1}, rs485: {mode: off},
     broadcast: silent, on_failure: silence, echo: auto, response_timeout: 2s}
  - {name: hmi, device: /dev/ttyS3, lines: [a], framing: rtu}
http:
  tokens: [{name: ops, role: operator, file: /run/secrets/ops, expires: 2027-12-31},
           {name: two, role: viewer, file: /run/secrets/two}]
  tls: {certificate: /tls/a.crt, key: /tls/a.key, ca: /tls/a-ca.crt, client: optional}
access:
  default: deny
  roles: [{name: setter, rights: [read, write]}]
  rules:
    - {name: no, deny: [write], from: [10.1.0.0/16], roles: [operator], tokens: [ops],
       faces: [http], listeners: ["127.0.0.1:502"], stations: [a/1], functions: [6],
       range: "400001"}
    - {name: yes, allow: [write], range: {table: holding-registers, address: 5, count: 2}}
mqtt: {broker: "mqtts://b:8883", topic: x, qos: 1, home_assistant: true, client_id: x, username: x, store: 200,
       password_file: /run/secrets/ops, keep_alive: 60s, write: none, ca: /run/secrets/ops,
       certificate: /run/secrets/ops, key: /run/secrets/ops}
relays: [{from: a-1/400001, to: a-1/400101, on_change: true, refresh: 60s}]
realtime: {priority: 20, lock_memory: true}
audit: {file: /var/log/audit.jsonl, rotate: 10MiB, keep: 5, on_failure: refuse_writes}
images: [{name: plant, unit: 99, points: [a-1/q]}]
alarms: [{name: wiring, finding: any}, {name: lost, line: a, down: true}]
store: {days: 90}
alarm_webhook: {url: "https://10.0.0.1/x", ca: /run/secrets/ops}
standby: {rank: 1, peer: "https://10.0.0.1:8443", token_file: /run/secrets/ops, ca: /tls/a-ca.crt}
)";

/// Keys that the values of their neighbours there rule out.
constexpr const char* kApart = R"(lines: [{name: a, device: sim}]
serial_masters:
  - {name: plc, device: /dev/ttyS2, rs485: {mode: kernel, receive_during_send: false}}
mqtt: {broker: "mqtts://b:8883", format: sparkplug, group: x, node: x,
       tls: {ca: /run/secrets/ops, certificate: /run/secrets/ops, key: /run/secrets/ops}}
)";

constexpr const char* kWords =
    "0 points /points/b.csv sparkplug mqtts://c "
    "1 2 3 7 0.2 8 16 20ms 2s 1s none even on off kernel rts low rtu ascii tcp take "
    "refuse read_only high_first master line station pass deny silent exception "
    "viewer operator warn json u16 i16 BADC UW120 GDT220 UB190 400009 400109 "
    "a-1/400209 panasonic-gt b 127.0.0.1:99 10.0.0.0/8 /dev/ttyS9 press/UW140 oven/GDT300 "
    "a/2 floor1/20 /run/secrets/other /profiles /tls/b.crt /tls/b.key /tls/b-ca.crt /tls/b.crl "
    "optional TLSv1.3 read two mqtt coils 127.0.0.1:503 allow 20MiB continue 2028-01-31 "
    "press/setpoint oven https://10.0.0.1:99 http://10.0.0.1:9093/api ";

struct Leaf {
    std::string key;  ///< "lines/stations/id": without list indices
    yaml::Node* value;
};

/// "10.0.0.0/8" is "0.0.0.0/0", and "20ms" is "0a": what looks alike is likely to be accepted.
std::string look_of(const std::string& text) {
    std::string look;
    for (const char c : text) {
        const char sign = c >= '0' && c <= '9'                     ? '0'
                          : (c | 0x20) >= 'a' && (c | 0x20) <= 'z' ? 'a'
                                                                   : c;
        if (look.empty() || look.back() != sign) look += sign;
    }
    return look;
}

/// What the table says that a key may be called.
const std::vector<std::string>& words_of(const std::string& key) {
    static const auto kWordsOf = [] {
        std::map<std::string, std::vector<std::string>> all;
        for (const config::KeyShape& shape : config::describe().keys) all[shape.path] = shape.words;
        return all;
    }();
    static const std::vector<std::string> kNone;
    const auto found = kWordsOf.find(key);
    return found == kWordsOf.end() ? kNone : found->second;
}

/// Alternative values, likely ones first: each that is not accepted costs a load.
std::vector<std::string> others(const Leaf& leaf) {
    const std::string& now = leaf.value->scalar;
    std::vector<std::string> all = words_of(leaf.key);
    std::vector<std::string> unlike;
    const std::string look = look_of(now);
    const auto add = [&](const std::string& word) {
        (look_of(word) == look ? all : unlike).push_back(word);
    };
    add(now == "true" ? "false" : "true");
    add("1" + now);
    add(now + "1");
    std::istringstream words(kWords);
    for (std::string word; words >> word;) add(word);
    all.insert(all.end(), unlike.begin(), unlike.end());
    std::erase(all, now);
    return all;
}

/// Templates and merges show by their effect.
void find_leaves(yaml::Node& node, const std::string& key, std::vector<Leaf>& leaves) {
    if (node.kind == yaml::Node::Kind::scalar) leaves.push_back({key, &node});
    for (yaml::Node& item : node.items) find_leaves(item, key, leaves);
    for (yaml::Entry& entry : node.entries) {
        const std::string& name = entry.key;
        if (name.starts_with("x-") || name.starts_with("template") || name == "<<") continue;
        find_leaves(entry.value, key.empty() ? name : key + '/' + name, leaves);
    }
}

/// Each change says what is done for it. What a session at the broker publishes has many keys; what
/// waits for the next start, or for connections to come, interrupts nothing.
void expect_needs(const config::Config& before, const config::Config& after,
                  const std::string& key) {
    std::set<std::string> said;
    std::set<std::string> removed;
    for (const Change& change : differences(before, after)) {
        const bool waits =
            change.needs == config::kNextStart || change.needs == config::kTlsRenewed;
        if (!change.needs.empty() && !waits) said.insert(change.needs);
        if (change.kind == Change::Kind::removed) removed.insert(change.path);
    }
    std::set<std::string> done;
    for (const Interruption& one : interruptions(before, after))
        if (!removed.contains(one.path)) done.insert(one.what);
    const bool publishes = key.starts_with("lines/") || key.starts_with("access/");
    if (publishes) done.erase(std::string(config::kConnectsAnew));
    EXPECT_EQ(said, done) << key;
}

/// What differs is seen in `GET /configuration`, and so in `check --format json`, and in `check`.
/// Contents of files are secrets, of which only the names are shown.
void expect_shown(const config::Config& before, const config::Config& after,
                  const std::string& key) {
    EXPECT_NE(inventory_json(before), inventory_json(after)) << key;
    EXPECT_NE(inventory_text(before), inventory_text(after)) << key;
}

/// A text that is loaded again and again with another value in one place.
struct Text {
    yaml::Node tree;
    std::optional<config::Config> before;
    std::vector<Leaf> leaves{};
};

/// The first values to try, and the rest of them.
enum class Tries : std::uint8_t { likely, further };
constexpr std::ptrdiff_t kLikely = 5;

/// Another value that the loader accepts makes a difference.
bool makes_a_difference(const Text& text, const Leaf& leaf, Tries tries) {
    const yaml::Node& tree = text.tree;
    const config::Config& before = *text.before;
    yaml::Node& value = *leaf.value;
    const yaml::Node kept = value;
    bool differs = false;
    std::vector<std::string> values = others(leaf);
    const auto cut = values.begin() + std::min(kLikely, std::ssize(values));
    if (tries == Tries::likely)
        values.erase(cut, values.end());
    else
        values.erase(values.begin(), cut);
    for (const std::string& other : values) {
        value.scalar = other;
        const auto after = load(yaml_text(tree));
        differs = after && !differences(before, *after).empty();
        if (differs) expect_needs(before, *after, leaf.key);
        if (differs) expect_shown(before, *after, leaf.key);
        if (differs) break;
    }
    value = kept;
    return differs;
}

std::string generic_path(const std::string& path, const std::string& key) {
    return path.empty() ? key : path + '/' + key;
}

/// The maps at this path; "" is the top.
void find_maps(yaml::Node& node, const std::string& path, const std::string& wanted,
               std::vector<yaml::Node*>& found) {
    if (node.kind == yaml::Node::Kind::map && path == wanted) found.push_back(&node);
    for (yaml::Node& item : node.items) find_maps(item, path, wanted, found);
    for (yaml::Entry& entry : node.entries)
        find_maps(entry.value, generic_path(path, entry.key), wanted, found);
}

/// `base` without the key in the first map that can have it, or with this value there.
std::optional<config::Config> load_with(const char* base, const std::string& path,
                                        const std::string& value) {
    yaml::Problems problems("x.yaml");
    yaml::Node tree = yaml::parse(base, problems);
    const std::size_t cut = path.rfind('/');
    std::vector<yaml::Node*> maps;
    find_maps(tree, "", cut == path.npos ? "" : path.substr(0, cut), maps);
    if (maps.empty()) return std::nullopt;
    const std::string key = path.substr(cut == path.npos ? 0 : cut + 1);
    std::erase_if(maps[0]->entries, [&](const yaml::Entry& entry) { return entry.key == key; });
    yaml::Node scalar;
    scalar.kind = yaml::Node::Kind::scalar;
    scalar.scalar = value;
    if (!value.empty()) maps[0]->entries.push_back({key, {}, scalar});
    return load(yaml_text(tree));
}

/// Values that the key may have, by what the table says of it.
std::vector<std::string> values_of(const config::KeyShape& key) {
    std::vector<std::string> all = key.words;
    if (key.kind == config::KeyShape::Kind::boolean) return {"true", "false"};
    if (key.kind == config::KeyShape::Kind::integer)
        for (const std::int64_t value : {key.min, key.max, key.min + 1, key.max - 1})
            all.push_back(std::to_string(value));
    if (key.kind == config::KeyShape::Kind::duration)
        for (const Duration value : {key.shortest, key.longest, Duration(20ms), Duration(2s)})
            all.push_back(yaml::format_duration(value));
    std::istringstream words(kWords);
    for (std::string word; words >> word;) all.push_back(word);
    return all;
}

/// True if some value of the key is not what leaving it out, or another value, means: of a key that
/// none of these texts has.
bool shows(const config::KeyShape& key) {
    for (const char* base : {kPlain, kFurther}) {
        std::optional<config::Config> first = load_with(base, key.path, "");
        for (const std::string& value : values_of(key)) {
            const auto other = load_with(base, key.path, value);
            if (other && first && !differences(*first, *other).empty()) {
                expect_shown(*first, *other, key.path);
                return true;
            }
            if (!first) first = other;  // it cannot be left out
        }
    }
    return false;
}

/// A key that is new in a table is here without another line: it is loaded, and `--diff`, a reload,
/// `config get`, `check` as text and as JSON, and `GET /configuration` know it. What the documents
/// and the schema have of it: test_reference.
TEST(EveryKey, OfAConfigurationMakesADifference) {
    using Kind = config::KeyShape::Kind;
    std::map<std::string, bool> keys;
    const std::string most = text_of(fs::path(TEST_DATA) / "every_key.yaml");
    std::list<Text> texts;  // leaves point into them
    for (const std::string& text :
         {std::string(kFurther), std::string(kPlain), std::string(kApart), most}) {
        yaml::Problems problems("x.yaml");
        Text& one = texts.emplace_back(yaml::parse(text, problems), load(text));
        const auto again = load(yaml_text(one.tree));
        ASSERT_TRUE(one.before && again && differences(*one.before, *again).empty())
            << yaml_text(one.tree);
        find_leaves(one.tree, "", one.leaves);
    }
    // Where a key cannot be changed in one place alone it can in another.
    for (const Tries tries : {Tries::likely, Tries::further}) {
        for (const Text& text : texts) {
            for (const Leaf& leaf : text.leaves) {
                bool& differs = keys[leaf.key];
                differs = differs || makes_a_difference(text, leaf, tries);
            }
        }
    }
    // An alarm has exactly one condition, so that none of these changes alone (golden/alarms.txt).
    for (const char* const condition : {"alarms/stale", "alarms/offline", "alarms/down"})
        keys[condition] = true;
    EXPECT_GE(keys.size(), 120U);
    for (const auto& [key, differs] : keys) EXPECT_TRUE(differs) << key;
    for (const config::KeyShape& key : config::describe().keys) {
        const bool has_value = key.kind != Kind::map && key.kind != Kind::list;
        const bool is_template = key.path.find("template") != std::string::npos;
        if (has_value && !is_template && !keys.contains(key.path))
            EXPECT_TRUE(shows(key)) << key.path;
    }
}

TEST(EveryKey, MeansItsDefaultWhereItIsLeftOut) {
    for (const config::KeyShape& key : config::describe().keys) {
        if (key.initial.empty()) continue;
        const std::string& path = key.path;
        auto with = load_with(kPlain, path, key.initial);
        const char* base = with ? kPlain : kFurther;  // some keys are for ASCII only
        if (!with) with = load_with(base, path, key.initial);
        const auto without = load_with(base, path, "");
        ASSERT_TRUE(without && with) << path;
        EXPECT_TRUE(differences(*without, *with).empty())
            << path << ": " << to_string(differences(*without, *with)[0]);
    }
}

}  // namespace
}  // namespace panelgate::explain::every_key_test
