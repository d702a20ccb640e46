#include "own_unit.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "support/hex.hpp"

namespace panelgate::tcp_server::own_unit_test {
namespace {

/// Two lines, and station 31 of the second as unit 7.
Diagnostics two_lines() {
    Diagnostics state;
    state.uptime = 65537s;
    state.lines = {{"floor1", true, 3, 12.34}, {"hall", false, 100000, 0}};
    state.counters.connections = 5;
    state.counters.requests = 70000;
    state.counters.exceptions = 9;
    state.counters.protocol_errors = 4;
    state.counters.busy = 2;
    state.counters.unanswered = 3;
    state.version = "1.2.34";
    state.url = "http://gateway:8080/";
    state.host = "gateway";
    state.station = [](std::uint8_t unit) -> std::optional<Diagnostics::Station> {
        if (unit != 7) return std::nullopt;
        Diagnostics::Station station;
        station.state = Health::online;
        station.line = 1;
        station.id = 31;
        station.last_answer = 70s;
        station.outcomes[Outcome::ok] = 65536;
        station.outcomes[Outcome::cached] = 2;
        station.outcomes[Outcome::exception] = 3;
        station.outcomes[Outcome::timeout] = 4;
        station.outcomes[Outcome::damaged] = 5;
        station.outcomes[Outcome::busy] = 6;
        station.outcomes[Outcome::offline] = 1;
        return station;
    };
    return state;
}

Bytes ask(const Bytes& request) { return answer_diagnostics(request, two_lines()); }

struct Row {
    const char* request;
    const char* reply;
};

void expect_replies(const std::vector<Row>& rows) {
    for (const Row& row : rows)
        EXPECT_EQ(to_hex(ask(*from_hex(row.request))), to_hex(*from_hex(row.reply))) << row.request;
}

TEST(Diagnostics, ShowsItsRegistersAndInputs) {
    expect_replies({
        // Lines and uptime, to both register reads.
        {"03 0000 000a", "03 14 0002 0002 0001 0001 0001 0003 007b 0000 ffff 0000"},
        {"04 0004 0002", "04 04 0001 0003"},
        // Version and counters of the listener.
        {"03 0064 000a", "03 14 0001 0002 0022 0005 0001 1170 0000 0009 0000 0004"},
        // The registers of unit 7, at 1000 + 16 * 7; nobody is unit 8.
        {"03 0458 0010",
         "03 20 0002 0002 001f 0000 0001 1170 0001 0002 0000 0003 0000 0004 0000 0005 0000 0007"},
        {"03 0468 0010",
         "03 20 0000 0000 0000 0000 0000 0000 0000 0000 0000 0000 0000 0000 0000 0000 0000 0000"},
        {"03 1387 0002", "83 02"},
        {"04 ffff 0001", "84 02"},
        // An input for each unit shows whether it answers.
        {"02 0000 0010", "02 02 80 00"},
        {"02 0007 0001", "02 01 01"},
        {"02 00ff 0002", "82 02"},
    });
    EXPECT_EQ(ask("02 0000 0100"_hex).size(), 34U);
}

TEST(Diagnostics, OneThatHasNeverAnsweredIsNotYoung) {
    Diagnostics state = two_lines();
    state.station = [](std::uint8_t) { return Diagnostics::Station{}; };
    EXPECT_EQ(answer_diagnostics("03 03e8 0006"_hex, state),
              "03 0c 0001 0000 0000 0000 ffff ffff"_hex);
}

TEST(Diagnostics, EveryReadInsideSucceedsAndNothingBeyond) {
    for (std::uint32_t count : {1u, 2u, 7u, 125u}) {
        for (std::uint32_t first = 0; first < 5200; ++first) {
            const Bytes request =
                modbus::encode_read({modbus::Table::holding_registers, first, count});
            const Bytes reply = ask(request);
            const bool inside = first + count <= 5000;
            ASSERT_EQ(reply[0] == 0x03, inside) << first << ' ' << count;
            ASSERT_TRUE(modbus::answers(request, reply));
        }
    }
}

TEST(Diagnostics, RefusesMalformedRequestsAndEveryOtherFunction) {
    const auto expect_refused = [](std::uint8_t code, const std::vector<const char*>& requests) {
        for (const char* request : requests) {
            const Bytes pdu = *from_hex(request);
            EXPECT_EQ(ask(pdu), (Bytes{static_cast<std::uint8_t>(pdu[0] | 0x80), code})) << request;
        }
    };
    expect_refused(3, {"03 0000 0000", "03 0000 007e", "03 0000", "02 0000 0000", "02 0000 07d1",
                       "2b 0e 01", "2b", "2b 0e 05 00"});
    expect_refused(1, {"01 0000 0001", "06 0000 0001", "07", "08 0000 a537", "0b", "0c", "11",
                       "14 00", "41", "2b 0d 01 00"});
}

/// The objects of a reply to 2B/0E, by id.
std::map<int, std::string> objects(const Bytes& reply) {
    std::map<int, std::string> found;
    Reader in(ByteView(reply).subspan(6));
    for (int left = in.u8(); left > 0; --left) {
        const int id = in.u8();
        const ByteView text = in.take(in.u8());
        found[id] = std::string(text.begin(), text.end());
    }
    EXPECT_TRUE(in.finished());
    return found;
}

TEST(Diagnostics, IdentifiesItselfInTwoLevels) {
    const std::map<int, std::string> basic = {{0, "panelgate"}, {1, "panelgate"}, {2, "1.2.34"}};
    std::map<int, std::string> regular = basic;
    regular.merge(std::map<int, std::string>{
        {3, "http://gateway:8080/"}, {4, "panelgate"}, {5, "Modbus gateway"}, {6, "gateway"}});
    EXPECT_EQ(objects(ask("2b 0e 01 00"_hex)), basic);
    EXPECT_EQ(objects(ask("2b 0e 02 00"_hex)), regular);
    EXPECT_EQ(objects(ask("2b 0e 03 00"_hex)), regular) << "there is no third level";
    EXPECT_EQ(objects(ask("2b 0e 02 05"_hex)).size(), 2U) << "from there on";
    EXPECT_EQ(objects(ask("2b 0e 01 05"_hex)), basic) << "a stream restarts";
    EXPECT_EQ(ask("2b 0e 04 06"_hex), "2b 0e 04 82 00 00 01 06 07 67617465776179"_hex);
    EXPECT_EQ(ask("2b 0e 04 07"_hex), "ab 02"_hex);
}

TEST(Diagnostics, TheLongestIdentificationFitsOneReply) {
    Diagnostics state = two_lines();
    state.url = state.host = state.version = std::string(300, 'x');
    const Bytes reply = answer_diagnostics("2b 0e 02 00"_hex, state);
    EXPECT_LE(reply.size(), modbus::kMaxPdu);
    EXPECT_EQ(objects(reply).size(), 7U);
}

TEST(Diagnostics, ThePrintedMapNamesWhatIsThere) {
    const std::string text = describe_register_map();
    for (const char* part : {"0..4999", "1000 + 16u", "4 + 3i", "43/14", "0..255"})
        EXPECT_NE(text.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace panelgate::tcp_server::own_unit_test
