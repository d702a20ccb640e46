#include <map>

#include "http_rig.hpp"
#include "writing.hpp"

namespace panelgate::web::verify_test {
namespace {

using modbus::Request;
using modbus::Table;

Verification of(const Bytes& pdu) {
    return *Verification::of(*Request::make(pdu, modbus::QuantityCheck::wide));
}

TEST(Verification, KnowsWhatEachWriteLeaves) {
    EXPECT_TRUE(of({5, 0, 9, 0xff, 0}).holds(std::vector<std::uint16_t>{1}));
    EXPECT_FALSE(of({5, 0, 9, 0, 0}).holds(std::vector<std::uint16_t>{1}));
    EXPECT_TRUE(of({6, 0, 9, 1, 2}).holds(std::vector<std::uint16_t>{0x102}));
    const Verification coils = of({15, 0, 9, 0, 9, 2, 0x81, 1});
    EXPECT_EQ(coils.span(), (modbus::Span{Table::coils, 9, 9}));
    EXPECT_TRUE(coils.holds(std::vector<std::uint16_t>{1, 0, 0, 0, 0, 0, 0, 1, 1}));
    EXPECT_FALSE(coils.holds(std::vector<std::uint16_t>{1, 0, 0, 0, 0, 0, 0, 1, 0}));
    const Verification words = of({16, 0, 9, 0, 2, 4, 0, 1, 0, 2});
    EXPECT_TRUE(words.holds(std::vector<std::uint16_t>{1, 2}));
    EXPECT_FALSE(words.holds(std::vector<std::uint16_t>{1}));
    EXPECT_FALSE(Verification::of(Request::read({Table::coils, 0, 1})));
}

TEST(Verification, OfAMaskLooksAtItsBitsOnly) {
    const Verification bit = of({22, 0, 9, 0xff, 0xfb, 0, 4});
    EXPECT_TRUE(bit.holds(std::vector<std::uint16_t>{0xfff4}));
    EXPECT_FALSE(bit.holds(std::vector<std::uint16_t>{0xfff0}));
}

/// Panels that store what is written to them: registers by station and address.
class ApiVerify : public HttpRig {
  protected:
    ApiVerify() {
        bus.script = [this](const bus::Request& request) { return answer(request); };
    }
    bus::Answer answer(const bus::Request& request) {
        if (request.request.is_read()) {
            if (mute) return test::FakeBus::fault(Fault::timeout, true);
            Writer out;
            const auto span = *request.request.span();
            out.u8(3).u8(2 * span.count);
            for (unsigned i = 0; i < span.count; ++i)
                out.u16(memory[{request.station, span.first + i}]);
            return test::FakeBus::reply(out.take());
        }
        const Bytes& pdu = request.request.pdu();
        const auto value = static_cast<std::uint16_t>(pdu[3] << 8 | pdu[4]);
        for (const int station : {5, 31}) {
            if (keeps && (request.station == station || request.station == 0))
                memory[{station, pdu[2]}] = value;
        }
        if (lost) return test::FakeBus::fault(Fault::timeout, true);
        return test::FakeBus::reply(pdu);
    }
    Reply put(const std::string& body) {
        return ask("PUT", "/api/v1/stations/press/devices/UW7", body);
    }
    Reply broadcast() {
        return ask("POST", "/api/v1/lines/floor1/broadcast",
                   R"({"table":"holding-registers","address":7,"values":[9],"verify":true})");
    }

    std::map<std::pair<int, unsigned>, std::uint16_t> memory;
    bool keeps = true;
    bool lost = false;
    bool mute = false;
};
constexpr const char* kNine = R"({"values":[9],"verify":true})";

TEST_F(ApiVerify, ReadsBackWhatWasWritten) {
    EXPECT_EQ(put(kNine).json(),
              json_of(R"({"transmitted":true,"confirmed":true,"verified":true})"));
    ASSERT_EQ(bus.requests.size(), 2u);
    EXPECT_EQ(last_pdu(), "03 00 07 00 01");
    EXPECT_EQ(put(R"({"values":[9]})").json().count("verified"), 0u);
    EXPECT_EQ(put(R"({"values":[9],"verify":1})").status(), 400u);
}

TEST_F(ApiVerify, TellsWhatIsThereInstead) {
    keeps = false;
    EXPECT_EQ(put(kNine).json(),
              json_of(R"({"transmitted":true,"confirmed":true,"verified":false,"read_back":[0]})"));
}

TEST_F(ApiVerify, P2TellsWhatBecameOfAWriteWhoseAnswerIsLost) {
    lost = true;
    const Reply reply = put(kNine);
    EXPECT_EQ(reply.status(), 504u);
    EXPECT_EQ(reply.at("transmitted"), true);
    EXPECT_EQ(reply.at("verified"), true);
    mute = true;
    const Reply unknown = put(kNine);
    EXPECT_EQ(unknown.at("verified"), nullptr);
    EXPECT_EQ(unknown.at("verify_detail"), "the station did not answer in time");
}

TEST_F(ApiVerify, OfMemoryThatCannotBeReadIsRefusedBeforeItIsWritten) {
    std::erase_if(panel.functions, [](const auto& rule) { return rule.code == 3; });
    const Reply reply = put(kNine);
    EXPECT_EQ(reply.status(), 422u);
    EXPECT_EQ(reply.at("rule"), "function");
    EXPECT_TRUE(bus.requests.empty());
}

TEST_F(ApiVerify, OfABroadcastAsksEachStation) {
    add_meter();
    bus.rights = {};
    const Reply all = broadcast();
    EXPECT_EQ(all.status(), 200u);
    EXPECT_EQ(all.json(), json_of(R"({"transmitted":true,"confirmed":true,"stations":[
        {"station":"press","verified":true},{"station":"meter","verified":true}]})"));
    keeps = false;
    memory[{5, 7}] = 8;
    const Reply some = broadcast();
    EXPECT_EQ(some.at("confirmed"), false);
    EXPECT_EQ(some.at("stations"), json_of(R"([{"station":"press","verified":true},
        {"station":"meter","verified":false,"read_back":[8]}])"));
    mute = true;
    EXPECT_EQ(broadcast().at("confirmed"), false);
}

}  // namespace
}  // namespace panelgate::web::verify_test
