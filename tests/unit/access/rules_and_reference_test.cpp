// Generated rules and requests: LineRules decides as the reference does.
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/modbus/request.hpp"
#include "reference.hpp"
#include "support/request.hpp"

namespace panelgate::access::rules_and_reference_test {
namespace {

using modbus::Span;
using modbus::Table;

constexpr std::uint32_t kNear = 40;  ///< items that ranges and requests share, so that edges meet

/// Draws rules, clients and requests of two lines. From a seed, so that a case can be seen again.
class Draw {
  public:
    explicit Draw(unsigned seed) : random_(seed) {}

    unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
    bool chance(unsigned percent) { return below(100) < percent; }
    template <class T>
    T one_of(const std::vector<T>& all) {
        return all[below(static_cast<unsigned>(all.size()))];
    }

    Settings settings() {
        Settings drawn;
        drawn.allow_by_default = chance(50);
        const unsigned rules = below(9);
        for (unsigned i = 0; i < rules; ++i)
            drawn.rules.push_back(rule("rule-" + std::to_string(i)));
        return drawn;
    }

    WhoRef who() {
        return make_who(
            {.face = one_of<Face>(
                 {Face::modbus_tcp, Face::udp, Face::http, Face::mqtt, Face::serial_master}),
             .address = one_of<std::string>({"10.0.0.7", "10.0.1.7", "192.168.1.1", ""}),
             .listener = one_of<std::string>({"0.0.0.0:502", "[::]:80", ""}),
             .token = one_of<std::string>({"", "ops", "panel"}),
             .standing = one_of<Role>(
                 {Role::none, Role::viewer, Role::operator_, Role::engineer, Role::admin}),
             .certificate_role = one_of<std::string>({"", "line-lead"})});
    }

    reference::Case request(const std::string& line, const std::vector<std::uint8_t>& listed) {
        reference::Case drawn;
        drawn.raw = chance(15);
        drawn.broadcast = chance(15);
        drawn.asked = pdu(drawn.broadcast);
        if (drawn.broadcast) {
            for (const std::uint8_t station : listed) drawn.places.emplace_back(line, station);
        } else {
            drawn.places.emplace_back(line, station());
            if (chance(60)) drawn.sent = translated(drawn.asked);
        }
        return drawn;
    }

  private:
    std::uint8_t station() { return one_of<std::uint8_t>({1, 2, 3, 9}); }
    Span span() {
        const unsigned first = below(kNear);
        return {one_of<Table>({modbus::kTables.begin(), modbus::kTables.end()}), first,
                1 + below(kNear - first)};
    }

    Rule rule(std::string name) {
        Rule drawn;
        drawn.name = std::move(name);
        drawn.allow = chance(50);
        for (const Act act : {Act::read, Act::write, Act::broadcast, Act::raw})
            if (chance(55)) drawn.acts.add(act);
        if (chance(30)) drawn.from = {{"10.0.0.0", one_of<unsigned>({0, 8, 16, 24, 32})}};
        if (chance(30)) drawn.roles = {one_of<std::string>({"operator", "line-lead", "none"})};
        if (chance(20)) drawn.tokens = {"ops"};
        if (chance(30)) drawn.faces = {one_of<Face>({Face::modbus_tcp, Face::http})};
        if (chance(20)) drawn.listeners = {"0.0.0.0:502"};
        if (chance(40)) drawn.stations = {{"floor1", station()}, {"floor2", station()}};
        if (chance(30)) drawn.functions = functions();
        if (chance(60)) add_range(drawn);
        return drawn;
    }
    std::vector<std::uint8_t> functions() {
        std::vector<std::uint8_t> drawn;
        for (const int code : {1, 3, 6, 8, 15, 16, 20, 21, 23, 24, 43, 65})
            if (chance(30)) drawn.push_back(static_cast<std::uint8_t>(code));
        return drawn;
    }
    void add_range(Rule& rule) {
        rule.range = "drawn";
        if (chance(50)) rule.unlisted_items = span();
        for (const char* line : {"floor1", "floor2"}) {
            for (const std::uint8_t id : std::vector<std::uint8_t>{1, 2, 3}) {
                if (chance(30)) continue;
                auto& items = rule.items[{line, id}];
                for (unsigned i = 1 + below(3); i > 0; --i) items.push_back(span());
            }
        }
    }

    Bytes pdu(bool broadcast) {
        const auto put = [](Bytes& to, unsigned word) {
            to.push_back(static_cast<std::uint8_t>(word >> 8));
            to.push_back(static_cast<std::uint8_t>(word & 0xFF));
        };
        Bytes made{broadcast ? one_of<std::uint8_t>({5, 6, 15, 16})
                             : one_of<std::uint8_t>(
                                   {1, 2, 3, 4, 5, 6, 7, 8, 15, 16, 20, 21, 22, 23, 24, 43, 65})};
        const unsigned first = below(kNear);
        const unsigned count = 1 + below(8);
        switch (made[0]) {
            case 7:
                return made;
            case 8:
                return {8, 0, 0, 0, 0};
            case 20:
                return {20, 7, 6, 0, 4, 0, 1, 0, 2};
            case 21:
                return {21, 9, 6, 0, 4, 0, 7, 0, 1, 6, 0xAF};
            case 43:
                return chance(50) ? Bytes{43, 14, 1, 0} : Bytes{43, 13, 1};
            case 65:
                return {65, 1, 2};
            default:
                put(made, first);
        }
        if (made[0] == 24) return made;
        put(made, made[0] == 5 ? 0xFF00 : count);
        if (made[0] == 22) put(made, 0);
        if (made[0] == 15) made.insert(made.end(), {1, 0});
        if (made[0] == 16) made.push_back(static_cast<std::uint8_t>(2 * count));
        if (made[0] == 16) made.resize(made.size() + 2 * count);
        if (made[0] != 23) return made;
        put(made, below(kNear));
        put(made, 2);
        made.insert(made.end(), {4, 0, 0, 0, 0});
        return made;
    }
    /// As profile::translate() may: 05 as 15, 06 as 16, 02 as 01, 04 as 03.
    static Bytes translated(Bytes pdu) {
        switch (pdu[0]) {
            case 2:
                pdu[0] = 1;
                return pdu;
            case 4:
                pdu[0] = 3;
                return pdu;
            case 5:
                return {15, pdu[1], pdu[2], 0, 1, 1, 1};
            case 6:
                return {16, pdu[1], pdu[2], 0, 1, 2, pdu[3], pdu[4]};
            default:
                return {};
        }
    }

    std::mt19937 random_;
};

bool judged(const LineRules& rules, const WhoRef& who, const reference::Case& one) {
    const auto asked = test::request_of(one.asked);
    std::optional<modbus::Request> sent;
    if (!one.sent.empty()) sent = test::request_of(one.sent);
    return rules
        .judge(who, {.station = one.broadcast ? std::uint8_t{0} : one.places[0].second,
                     .asked = &asked,
                     .sent = sent ? &*sent : nullptr,
                     .raw = one.raw})
        .allowed;
}

TEST(RulesAndReference, DecideAlikeInTwoThousandGeneratedCases) {
    constexpr unsigned kPlants = 500;
    constexpr unsigned kRequests = 40;
    const std::vector<std::uint8_t> listed{1, 2, 3};
    unsigned denied = 0;
    for (unsigned seed = 0; seed < kPlants; ++seed) {
        Draw draw(seed);
        const auto settings = std::make_shared<const Settings>(draw.settings());
        const LineRules floor1(settings, "floor1", listed);
        const LineRules floor2(settings, "floor2", listed);
        const std::vector<WhoRef> people{draw.who(), draw.who(), draw.who(), draw.who()};
        for (unsigned i = 0; i < kRequests; ++i) {
            const bool first = draw.chance(50);
            const WhoRef& who = draw.one_of(people);
            const reference::Case one = draw.request(first ? "floor1" : "floor2", listed);
            const bool allowed = reference::allows(*settings, *who, one);
            denied += allowed ? 0U : 1U;
            ASSERT_EQ(judged(first ? floor1 : floor2, who, one), allowed)
                << "seed " << seed << ", request " << i;
        }
    }
    EXPECT_GT(denied, kPlants * kRequests / 4);
    EXPECT_LT(denied, kPlants * kRequests * 3 / 4) << "both answers have to occur";
}

}  // namespace
}  // namespace panelgate::access::rules_and_reference_test
