#include "support/vectors.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/sim/station.hpp"

namespace panelgate::sim::vectors_test {
namespace {

/// Prefix of a vector's name -> the demo panel that it is sent to.
struct Panel {
    const char* prefix;
    const char* profile;
    std::uint8_t id;
};
constexpr Panel kPanels[] = {{"gplp_", "autonics-gplp-s", 31},
                             {"gp2005_", "autonics-gp-2005", 5},
                             {"arm_", "autonics-arm", 17},
                             {"gt_", "panasonic-gt", 20},
                             {"cp2e_", "omron-cp2e", 1}};

const Panel& panel_of(const Vector& v) {
    for (const Panel& panel : kPanels)
        if (v.name().starts_with(panel.prefix)) return panel;
    throw std::logic_error("no panel for " + v.name());
}

/// The frames of the manuals (part 7) whose reply is shown, or not.
std::vector<Vector> vectors_of_panels(bool with_reply) {
    std::vector<Vector> chosen;
    for (Vector& v : load_vectors(TEST_DATA "/vectors.yaml")) {
        const bool wanted = v.text("part") == "7" && v.kind() != "broadcast";
        if (wanted && v.bytes("response").has_value() == with_reply) chosen.push_back(std::move(v));
    }
    return chosen;
}
std::string name_of(const ::testing::TestParamInfo<Vector>& info) { return info.param.name(); }

Bytes pdu_of(const Bytes& adu) { return Bytes(adu.begin() + 1, adu.end() - 2); }

/// The frame with the right CRC: as printed, or as corrected where the print is an erratum.
Bytes good_frame(const Vector& v, const std::string& key) {
    return v.bytes(key + "_corrected").value_or(*v.bytes(key));
}

/// Reply of a fresh panel, `running` after its first request.
Bytes ask(const Vector& v, Duration running) {
    static const profile::Catalogue catalogue = profile::Catalogue::shipped();
    const Panel& panel = panel_of(v);
    Station station(*catalogue.find(panel.profile), panel.id);
    const TimePoint start{};
    station.handle(start, 0, Bytes{0x03, 0xFF, 0xFF, 0x00, 0x01});
    return station.handle(start + running, 0, pdu_of(good_frame(v, "request")));
}

class FrameOfAManual : public ::testing::TestWithParam<Vector> {};

TEST_P(FrameOfAManual, IsAnsweredByteForByte) {
    const Vector& v = GetParam();
    const Bytes expected = good_frame(v, "response");
    const std::uint8_t station = expected[0];
    for (const Duration running : {Duration(0s), Duration(7s), Duration(3601s)}) {
        const Bytes reply = modbus::encode_adu(station, ask(v, running));
        EXPECT_EQ(to_hex(reply), to_hex(expected)) << to_seconds(running) << " s after the start";
    }
}

INSTANTIATE_TEST_SUITE_P(Vectors, FrameOfAManual, ::testing::ValuesIn(vectors_of_panels(true)),
                         name_of);

class FrameWithoutAPrintedReply : public ::testing::TestWithParam<Vector> {};

TEST_P(FrameWithoutAPrintedReply, IsAnsweredAsItsLayoutSays) {
    const Vector& v = GetParam();
    const Bytes request = pdu_of(*v.bytes("request"));
    const Bytes reply = ask(v, 1s);
    if (v.name() == "cp2e_fc01_w0_00_to_w127_14") {  // 2047 bits fit no byte count
        EXPECT_EQ(to_hex(reply), "81 03");
        return;
    }
    EXPECT_TRUE(modbus::answers(request, reply)) << to_hex(reply);
    EXPECT_FALSE(modbus::exception_of(reply)) << to_hex(reply);
}

INSTANTIATE_TEST_SUITE_P(Vectors, FrameWithoutAPrintedReply,
                         ::testing::ValuesIn(vectors_of_panels(false)), name_of);

TEST(FramesOfTheManuals, AreAllThere) {
    EXPECT_EQ(vectors_of_panels(true).size(), 21u);
    EXPECT_EQ(vectors_of_panels(false).size(), 11u);
    std::map<std::string, int> panels;
    for (const Vector& v : vectors_of_panels(true)) ++panels[panel_of(v).profile];
    EXPECT_EQ(panels, (std::map<std::string, int>{{"autonics-gplp-s", 5},
                                                  {"autonics-gp-2005", 3},
                                                  {"autonics-arm", 5},
                                                  {"panasonic-gt", 4},
                                                  {"omron-cp2e", 4}}));
}

}  // namespace
}  // namespace panelgate::sim::vectors_test
