#include "panelgate/tls/replacement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "panelgate/tls/judge.hpp"
#include "tls_rig.hpp"

namespace panelgate::tls::replacement_test {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kDay = 24 * 3600;

class ReplacementTest : public ::testing::Test {
  protected:
    ReplacementTest() {
        used.crl = "crl.pem";
        used.material.crl = list(plant.ca, 0);
        fresh = used;
    }
    /// Of `days` ago.
    std::string list(const Issued& ca, int days) const {
        const Issued lost = issue_client(ca, "lost", {}, valid());
        return revoke(ca, "", lost.certificate, {now - days * kDay, 30});
    }
    void take(const Issued& pair) {
        fresh.material.certificate = pair.certificate;
        fresh.material.key = pair.key;
    }
    std::string noticed(int days = 0) const {
        return why_kept(used, fresh, Arrival::noticed, now + days * kDay);
    }
    std::string asked_for() const { return why_kept(used, fresh, Arrival::asked_for, now); }

    TestPlant plant;
    Issued stranger = issue_ca("Plant CA", valid(365));
    std::int64_t now = std::time(nullptr);
    Settings used = plant.settings(ClientCertificate::required);
    Settings fresh;
};

TEST_F(ReplacementTest, TakesWhatIsAsGood) {
    EXPECT_EQ(noticed(), "");
    take(issue_server(plant.ca, {"gateway.plant", "127.0.0.1", "one.more"}, valid(90)));
    fresh.material.crl = list(plant.ca, -1);
    EXPECT_EQ(noticed(2), "");
    EXPECT_THAT(asked_for(), HasSubstr("which is still to come")) << "of a clock that is ahead";
}

TEST_F(ReplacementTest, KeepsAValidPairBeforeOneThatIsNot) {
    const std::vector<std::string> names{"gateway.plant", "127.0.0.1"};
    take(issue_server(plant.ca, names, {now - 20 * kDay, 5}));
    EXPECT_THAT(noticed(),
                HasSubstr("gateway.crt has expired on " + date_text(now - 15 * kDay - 3600)));
    EXPECT_THAT(asked_for(), HasSubstr("has expired"));
    EXPECT_EQ(noticed(40), "") << "the one in use has expired as well";
    take(issue_server(plant.ca, names, {now + 5 * kDay, 50}));
    EXPECT_THAT(noticed(), HasSubstr("is valid from"));
    EXPECT_EQ(noticed(6), "") << "now it is";
}

TEST_F(ReplacementTest, KeepsAPairBeforeOneThatNoClientTakes) {
    take(issue_client(plant.ca, "gateway.plant", {}, valid()));
    EXPECT_THAT(noticed(), HasSubstr("is not one of a server (key usage)"));
    EXPECT_THAT(asked_for(), HasSubstr("is not one of a server"));
    take(issue_server(plant.ca, {"gateway.plant", "127.0.0.1"}, valid()));
    fresh.material.certificate += issue_ca("between", {now - 20 * kDay, 5}).certificate;
    EXPECT_THAT(asked_for(), HasSubstr("CN=between, which stands behind the gateway's"));
    EXPECT_THAT(doubts(fresh, {}, now).front(), HasSubstr("CN=between, which stands behind"));
}

TEST_F(ReplacementTest, KeepsTheNamesThatClientsKnowUnlessAskedFor) {
    take(issue_server(plant.ca, {"gateway.plant", "10.0.0.1"}, valid()));
    EXPECT_THAT(noticed(), HasSubstr("is not for 127.0.0.1"));
    EXPECT_THAT(noticed(), HasSubstr("`panelgate reload` takes it"));
    take(issue_server(plant.ca, {"other.plant"}, valid()));
    EXPECT_THAT(noticed(), HasSubstr("is not for gateway.plant"));
    EXPECT_EQ(asked_for(), "");
}

TEST_F(ReplacementTest, AWildcardHasTheNamesThatItFits) {
    take(issue_server(plant.ca, {"gateway.hall.plant"}, valid()));
    used = fresh;
    take(issue_server(plant.ca, {"*.hall.plant"}, valid()));
    EXPECT_EQ(noticed(), "");
}

TEST_F(ReplacementTest, KeepsTheCaThatClientsKnowUnlessAskedFor) {
    take(issue_server(stranger, {"gateway.plant", "127.0.0.1"}, valid()));
    EXPECT_THAT(noticed(), HasSubstr("is of another CA"));
    fresh.material.ca = stranger.certificate;
    EXPECT_THAT(noticed(), HasSubstr("is of another CA")) << "nor both together";
    fresh.material.crl = list(stranger, 0);
    EXPECT_EQ(asked_for(), "");
}

TEST_F(ReplacementTest, ACaMovesInStepsWithoutAsking) {
    fresh.material.ca = plant.ca.certificate + stranger.certificate;
    fresh.material.crl = used.material.crl + list(stranger, 0);
    EXPECT_EQ(noticed(), "");
    used = fresh;
    take(issue_server(stranger, {"gateway.plant", "127.0.0.1"}, valid()));
    EXPECT_EQ(noticed(), "");
    used = fresh;
    fresh.material.ca = stranger.certificate;
    EXPECT_EQ(noticed(), "");
}

TEST_F(ReplacementTest, KeepsABundleThatSignsTheGatewaysOwnCertificate) {
    fresh.material.ca = stranger.certificate;
    EXPECT_THAT(noticed(), HasSubstr("ca.crt has not signed the gateway's own certificate"));
    used.material.ca = issue_ca("Clients", valid(300)).certificate;
    EXPECT_THAT(noticed(), HasSubstr("has nothing in common"));
    fresh.material.ca = issue_ca("Old", {now - 20 * kDay, 5}).certificate;
    EXPECT_THAT(asked_for(), HasSubstr("is not valid now"));
}

TEST_F(ReplacementTest, WithoutABundleTheTopOfTheChainCounts) {
    used.ca = fresh.ca = "";
    used.material.ca = fresh.material.ca = "";
    take(issue_server(issue_ca("Another", valid()), {"gateway.plant", "127.0.0.1"}, valid()));
    EXPECT_THAT(noticed(), HasSubstr("is of another CA"));
    EXPECT_EQ(noticed(31), "") << "better than one that has expired";
    take(issue_server(plant.ca, {"gateway.plant", "127.0.0.1"}, valid()));
    EXPECT_EQ(noticed(), "");
}

TEST_F(ReplacementTest, KeepsAListThatIsGood) {
    fresh.material.crl = list(plant.ca, 40);
    EXPECT_THAT(noticed(), HasSubstr("crl.pem is overdue since"));
    EXPECT_THAT(asked_for(), HasSubstr("is overdue since"));
    fresh.material.crl = list(stranger, 0);
    EXPECT_THAT(noticed(), HasSubstr("is not of the CA whose list is in use"));
    EXPECT_THAT(asked_for(), HasSubstr("is not of the CA"));
    fresh.material.crl = list(issue_ca("Another", valid()), 0);
    EXPECT_THAT(noticed(), HasSubstr("is not of the CA"));
    fresh.material.crl = list(plant.ca, 2);
    EXPECT_THAT(noticed(), HasSubstr("is older than the one in use"));
    EXPECT_EQ(asked_for(), "");
}

TEST_F(ReplacementTest, FilesThatAreCutOffMakeNoContext) {
    const Settings good = used;
    const auto refused = [&](std::string Material::* file, const std::string& content) {
        used = good;
        used.material.*file = content;
        try {
            Context unused(used);
            return std::string();
        } catch (const Unusable& why) {
            return std::string(why.what());
        }
    };
    const std::string both = plant.ca.certificate + stranger.certificate;
    EXPECT_EQ(refused(&Material::ca, both), "");
    EXPECT_EQ(refused(&Material::ca, "# the plant's -----\n" + both + "\n# end\n"), "");
    for (const std::size_t size :
         {both.size() - 5, both.size() - 200, plant.ca.certificate.size() + 8})
        EXPECT_THAT(refused(&Material::ca, both.substr(0, size)), HasSubstr("ca.crt is damaged"));
    std::string damaged = both;
    damaged[plant.ca.certificate.size() + 100] = '!';
    EXPECT_THAT(refused(&Material::ca, damaged), HasSubstr("ca.crt is damaged"));
    const std::string lists = used.material.crl + list(stranger, 0);
    EXPECT_THAT(refused(&Material::crl, lists.substr(0, lists.size() - 60)),
                HasSubstr("crl.pem is damaged"));
    EXPECT_THAT(refused(&Material::certificate, plant.server.certificate + both.substr(0, 300)),
                HasSubstr("gateway.crt is damaged"));
}

TEST_F(ReplacementTest, SaysWhoseCertificateItIsAndWhichFilesChanged) {
    const Summary own = summary_of(plant.server.certificate);
    EXPECT_EQ(own.subject, "CN=gateway.plant");
    EXPECT_EQ(own.issuer, "CN=Plant CA");
    EXPECT_EQ(own.serial.size(), 32U);
    EXPECT_NEAR(static_cast<double>(own.end - own.begin), 30 * kDay, 60);
    take(issue_server(plant.ca, {"x"}, valid()));
    fresh.material.crl = list(plant.ca, 0);
    EXPECT_EQ(changed_files(used.material, fresh.material), "certificate, key, crl");
}

}  // namespace
}  // namespace panelgate::tls::replacement_test
