#include <gtest/gtest.h>

#include "panelgate/profile/load_profile.hpp"
#include "panelgate/sim/station.hpp"

namespace panelgate::sim::identification_test {
namespace {

TEST(Identification, RecognisesEachSimulatedPanelByItsReads) {
    const profile::Catalogue shipped = profile::Catalogue::shipped();
    int identified = 0;
    for (const auto& [name, profile] : shipped.all()) {
        Station station(profile, profile.first_station);
        for (const profile::Identification& how : profile.identification) {
            const Bytes reply = station.handle(TimePoint(1h), 0, how.request);
            ASSERT_GE(reply.size(), how.reply.size()) << name;
            EXPECT_EQ(
                Bytes(reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(how.reply.size())),
                how.reply)
                << name << ": " << how.means;
            ++identified;
        }
    }
    EXPECT_GE(identified, 5);
}

}  // namespace
}  // namespace panelgate::sim::identification_test
