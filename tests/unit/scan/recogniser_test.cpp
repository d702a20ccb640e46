#include "recogniser.hpp"

#include <gmock/gmock.h>

#include "panelgate/modbus/request.hpp"
#include "support/hex.hpp"
#include "virtual_line.hpp"

namespace panelgate::scan::recogniser_test {
namespace {

using ::testing::HasSubstr;

const SerialFormat k38400{38400, 8, Parity::none, 1};

/// Answers all probes from a simulated panel and returns the candidates.
std::vector<Candidate> recognise(const profile::PanelProfile& panel, std::uint8_t station,
                                 const std::optional<SerialFormat>& format, int& asked) {
    sim::Station simulated(panel, station);
    Recogniser recogniser(shipped(), station, format, panel.crc_order);
    asked = 0;
    while (const auto probe = recogniser.next_probe()) {
        EXPECT_TRUE(modbus::is_pure_read(*probe));
        ++asked;
        recogniser.on_reply(*probe, simulated.handle(TimePoint(1h), 0, *probe));
    }
    return recogniser.candidates();
}

TEST(Recogniser, KnowsEveryShippedProfileByItsAnswersInFewReads) {
    for (const auto& [name, panel] : shipped().all()) {
        for (const auto& format : {std::optional(k38400), std::optional<SerialFormat>()}) {
            int asked = 0;
            const auto candidates = recognise(panel, 9, format, asked);
            ASSERT_EQ(candidates.size(), 1u) << name;
            EXPECT_EQ(candidates[0].profile, name) << candidates[0].why;
            EXPECT_LE(asked, 20) << name;
        }
    }
}

TEST(Recogniser, TellsThreePanelsWithTheSameIdentificationApart) {
    int asked = 0;
    for (const char* name : {"autonics-gplp-s", "autonics-gplp-a", "autonics-gp-2005"}) {
        const auto candidates = recognise(*shipped().find(name), 31, k38400, asked);
        ASSERT_EQ(candidates.size(), 1u);
        EXPECT_EQ(candidates[0].profile, name);
        EXPECT_THAT(candidates[0].why, HasSubstr("function 04 is refused; "));
    }
}

TEST(Recogniser, ConsidersOnlyWhatCanHaveTheAddressAndTheFormat) {
    int asked = 0;
    const auto& panel = *shipped().find("autonics-gplp-s");
    EXPECT_EQ(recognise(panel, 32, k38400, asked)[0].profile, "generic") << "1 to 31";
    EXPECT_EQ(recognise(panel, 3, SerialFormat{}, asked)[0].profile, "generic") << "38400 8N1";
}

TEST(Recogniser, NamesWhatIsNearestWhenNoneFits) {
    profile::PanelProfile small = *shipped().find("omron-cp2e");
    small.areas[1].readable.last = 4095;
    int asked = 0;
    const auto candidates = recognise(small, 3, k38400, asked);
    ASSERT_EQ(candidates.size(), 1u);
    EXPECT_EQ(candidates[0].profile, "generic");
    EXPECT_THAT(candidates[0].why, HasSubstr("no panel profile fits"));
}

TEST(Recogniser, ForgivesOtherMemorySizesToAPanelThatSaysItsName) {
    profile::PanelProfile arm = *shipped().find("autonics-arm");
    arm.areas[0].readable.last = 31;
    int asked = 0;
    const auto candidates = recognise(arm, 3, k38400, asked);
    EXPECT_EQ(candidates[0].profile, "autonics-arm");
    EXPECT_THAT(candidates[0].why, HasSubstr("the model name begins with AR"));
}

TEST(Recogniser, GivesAllThatCannotBeToldApart) {
    profile::Catalogue profiles = shipped();
    profile::PanelProfile twin = *shipped().find("panasonic-gt");
    twin.name = "panasonic-twin";
    profiles.add(twin);
    sim::Station simulated(twin, 4);
    Recogniser recogniser(profiles, 4, k38400);
    while (const auto probe = recogniser.next_probe())
        recogniser.on_reply(*probe, simulated.handle(TimePoint(1h), 0, *probe));
    const auto candidates = recogniser.candidates();
    ASSERT_EQ(candidates.size(), 2u);
    EXPECT_EQ(candidates[0].profile, "panasonic-gt");
    EXPECT_EQ(candidates[1].profile, "panasonic-twin");
}

TEST(Recogniser, LearnsNothingFromSilenceAndFromABusyPanel) {
    for (const auto& reply : {std::optional<Bytes>(), std::optional<Bytes>("83 06"_hex)}) {
        Recogniser recogniser(shipped(), 4, k38400);
        int asked = 0;
        while (const auto probe = recogniser.next_probe()) {
            recogniser.on_reply(*probe, reply);
            ASSERT_LT(++asked, 100);
        }
        EXPECT_EQ(recogniser.candidates()[0].profile, "generic");
        EXPECT_EQ(recogniser.candidates()[0].why, "no panel profile fits");
    }
}

}  // namespace
}  // namespace panelgate::scan::recogniser_test
