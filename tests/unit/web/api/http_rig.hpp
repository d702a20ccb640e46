#pragma once

#include <gmock/gmock.h>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "support/fake_bus.hpp"
#include "support/http_client.hpp"

namespace panelgate::web {

namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using test::Client;
using test::json_of;
using test::Reply;

/// Words UW (read to 999, write to 499) and bits UB over them; GR is read-only; TM is an input.
inline profile::PanelProfile test_profile() {
    using modbus::Table;
    profile::PanelProfile profile;
    profile.name = "test-panel";
    const auto area = [&](const char* name, Table table, std::uint32_t last) -> profile::Area& {
        profile::Area& made = profile.areas.emplace_back();
        made.name = name;
        made.notation.prefix = name;
        made.table = table;
        made.readable = {0, last};
        return made;
    };
    area("UW", Table::holding_registers, 999).writable = profile::AddressRange{0, 499};
    profile::Area& bits = area("UB", Table::coils, 15999);
    bits.notation.bit = profile::BitDigits::hex;
    bits.view_of = "UW";
    bits.writable = profile::AddressRange{0, 7999};
    area("TM", Table::input_registers, 99);
    profile::Area& gdt = area("GDT", Table::input_registers, 99);
    gdt.also = {Table::holding_registers};
    gdt.writable = profile::AddressRange{0, 99};
    for (const int code : {1, 3, 5, 6, 16}) {
        profile.functions.push_back({static_cast<std::uint8_t>(code), 0, true, ""});
    }
    profile.functions[1].max_count = 32;  // 03
    profile.functions[4].max_count = 4;   // 16
    profile.exceptions.push_back({2, "Address is outside the range"});
    return profile;
}

/// The writable register UW7, at most 100 bar.
inline points::Point oil_point() {
    points::Point oil;
    oil.name = "oil";
    oil.at = "UW7";
    oil.address = 7;
    oil.unit = "bar";
    oil.writable = true;
    oil.max = 100;
    return oil;
}

/// A request as text, for clients that do not wait for its reply.
inline std::string http_text(const std::string& method, const std::string& target,
                             const std::string& headers = "") {
    return method + " " + target + " HTTP/1.1\r\nHost: x\r\n" + headers + "\r\n";
}
/// PUT of {"values":[1]} to coil 1 of press.
inline std::string put_coil_text() {
    return http_text("PUT", "/api/v1/stations/press/coils/1", "Content-Length: 14\r\n") +
           R"({"values":[1]})";
}

inline std::string detail_of(const Reply& reply) {
    return std::string(reply.at("detail").as_string());
}
/// "range false": the values of these members, whose names are separated by blanks.
inline std::string members(const boost::json::object& object, const std::string& names) {
    std::string text;
    std::istringstream in(names);
    for (std::string name; in >> name;) {
        const boost::json::value& value = object.at(name);
        if (!text.empty()) text += ' ';
        text += value.is_string() ? std::string(value.as_string()) : json_text(value);
    }
    return text;
}
/// "422 range false": the status and these members.
inline std::string status_and(const Reply& reply, const std::string& names) {
    return std::to_string(reply.status()) + ' ' + members(reply.json(), names);
}

/// A row of a table of requests: a path or a body, and the answer to it ("": any detail).
struct Asked {
    std::string what;
    unsigned status;
    std::string detail{};
};

/// A server on loopback with line floor1: press (31, with test_profile) and meter (5, read-only,
/// panel type unknown). Line floor2 has the same bus and refuses unlisted stations.
class HttpRig : public ::testing::Test {
  protected:
    HttpRig() : bus(io.get_executor()), panel(test_profile()) {
        settings.port = 0;
        settings.anonymous = Role::admin;
        settings.hosts = {"x"};
        directory.lines.push_back({"floor1", "/dev/ttyUSB0", &bus, true});
        directory.lines.push_back({"floor2", "/dev/ttyUSB1", &bus, false});
        directory.generic = shipped.find("generic");
        StationEntry press;
        static_cast<bus::StationRef&>(press) = {"press", "floor1", 31, &bus};
        press.profile = &panel;
        press.unit = 101;
        directory.stations.push_back(std::move(press));
        answer_normally();
    }
    ~HttpRig() override {
        server.reset();
        io.poll();
    }

    /// The rig's own directory, which tests change.
    std::shared_ptr<const Directory> shown() const { return {std::shared_ptr<void>(), &directory}; }
    void add_meter() {
        StationEntry meter;
        static_cast<bus::StationRef&>(meter) = {"meter", "floor1", 5, &bus};
        meter.profile = directory.generic;
        meter.unknown_panel = true;
        meter.read_only = true;
        bus.rights = bus::Rights({{5, {"meter", bus::Access::read_only, {}}}});
        directory.stations.push_back(std::move(meter));
    }
    Server& start() {
        Providers providers;
        providers.figures = [this] { return [text = metrics] { return text; }; };
        providers.metrics_type = "text/plain; version=0.0.4; charset=utf-8";
        providers.ready = [this] { return ready; };
        providers.missing = [this] { return missing; };
        providers.version = "1.2.3";
        providers.commit = "3b4b6e8f0a1c";
        providers.compiler = "clang 19.1.7";
        providers.libraries = {{"boost", "1.81.0"}};
        providers.now = [this] { return now; };
        providers.wall = [this] { return wall; };
        providers.relays = [this] { return relays; };
        providers.events = &events;
        providers.discovery = discovery;
        providers.configuration = configuration;
        providers.settings = api;
        server = std::make_unique<Server>(io.get_executor(), settings, shown(), providers);
        EXPECT_FALSE(server->start());
        return *server;
    }
    Client connect() {
        if (!server) start();
        return Client(io, server->port());
    }
    Reply ask(const std::string& method, const std::string& target, const std::string& body = "",
              const std::string& headers = "") {
        return connect().ask(method, target, body, headers);
    }
    Reply get(const std::string& target) { return ask("GET", target); }
    /// GET with this beginning of the path.
    void expect_gets(const std::string& base, std::initializer_list<Asked> rows) {
        for (const Asked& row : rows) expect(row, get(base + row.what));
    }
    /// The same with bodies.
    void expect_bodies(const std::string& method, const std::string& target,
                       std::initializer_list<Asked> rows) {
        for (const Asked& row : rows) expect(row, ask(method, target, row.what));
    }
    /// The same where all have one status.
    void expect_gets(const std::string& base, unsigned status,
                     std::initializer_list<const char*> paths) {
        for (const char* path : paths) expect({path, status}, get(base + path));
    }
    void expect_bodies(const std::string& method, const std::string& target, unsigned status,
                       std::initializer_list<const char*> bodies) {
        for (const char* body : bodies) expect({body, status}, ask(method, target, body));
    }
    static void expect(const Asked& row, const Reply& reply) {
        EXPECT_EQ(reply.status(), row.status) << row.what;
        if (!row.detail.empty()) {
            EXPECT_EQ(detail_of(reply), row.detail) << row.what;
        }
    }
    /// Sends and runs the server until the bus has the request.
    void begin(Client& client, const std::string& text) {
        const std::size_t before = bus.requests.size();
        client.send(text);
        while (bus.requests.size() == before) io.run_one();
    }
    /// A client that asks this and leaves before the answer.
    void ask_and_leave(const std::string& text) {
        Client lost = connect();
        begin(lost, text);
    }
    /// The answer, and how many turns others have had meanwhile.
    std::pair<Reply, std::size_t> get_among_others(const std::string& target) {
        Client client = connect();
        client.send(http_text("GET", target));
        std::size_t turns = 0;
        const std::function<void()> turn = [&] {
            if (++turns < 10'000) boost::asio::post(io, turn);
        };
        boost::asio::post(io, turn);
        Reply reply = client.receive();
        const std::size_t had = std::exchange(turns, 10'000u);
        io.poll();  // the pending turn is the last
        return {std::move(reply), had};
    }

    void answer_normally() {
        bus.script = [](const bus::Request& request) { return answer_from_addresses(request); };
    }
    void answer_with(Fault fault, bool transmitted) {
        bus.script = [=](const bus::Request&) { return test::FakeBus::fault(fault, transmitted); };
    }
    void answer_with(const Bytes& pdu) {
        bus.script = [pdu](const bus::Request&) { return test::FakeBus::reply(pdu); };
    }
    /// Requests stay open until bus.release().
    void hold_answers() {
        bus.script = [](const bus::Request&) { return std::nullopt; };
    }
    std::string last_pdu() const { return to_hex(bus.requests.back().request.pdu()); }
    std::vector<std::string> pdus() const {
        std::vector<std::string> all;
        for (const bus::Request& request : bus.requests)
            all.push_back(to_hex(request.request.pdu()));
        return all;
    }

    /// Register n holds n, bit n is set when n is odd; writes are confirmed.
    static bus::Answer answer_from_addresses(const bus::Request& request) {
        Reader in(request.request.pdu());
        const std::uint8_t function = in.u8();
        const std::uint16_t address = in.u16();
        const std::uint16_t count = in.u16();
        Writer out;
        out.u8(function);
        if (function == 1 || function == 2) {
            std::vector<bool> bits;
            for (unsigned i = 0; i < count; ++i) bits.push_back((address + i) % 2 == 1);
            const Bytes packed = modbus::pack_bits(bits);
            out.u8(static_cast<unsigned>(packed.size())).raw(packed);
        } else if (function == 3 || function == 4) {
            out.u8(2u * count);
            for (unsigned i = 0; i < count; ++i) out.u16(address + i);
        } else {
            out.u16(address).u16(count);
        }
        return test::FakeBus::reply(out.take());
    }

    boost::asio::io_context io;
    test::FakeBus bus;
    profile::Catalogue shipped = profile::Catalogue::shipped();
    profile::PanelProfile panel;
    Directory directory;
    Settings settings;
    ApiSettings api;
    TimePoint now{1h};
    WallTime wall{std::chrono::seconds(1'790'000'000)};  ///< 2026-09-21T14:13:20Z
    std::vector<points::RelayStatus> relays;
    EventHub events;
    DiscoverySource* discovery = nullptr;
    std::function<std::string()> configuration;
    std::string metrics = "up 1\n";  ///< the text of /metrics
    bool ready = true;
    std::string missing;
    std::unique_ptr<Server> server;
};

}  // namespace panelgate::web
