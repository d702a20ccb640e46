#include "panelgate/tls/judge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tls_rig.hpp"

namespace panelgate::tls::judge_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kHour = 3600;  // a new certificate is valid since an hour before
constexpr std::int64_t kDay = 24 * kHour;

class JudgeTest : public ::testing::Test {
  protected:
    std::vector<std::string> after(int days, const std::vector<std::string>& names = {}) const {
        return doubts(settings, names, made + days * kDay);
    }

    TestPlant plant;
    std::int64_t made = std::time(nullptr);
    Settings settings = plant.settings(ClientCertificate::required);
};

TEST_F(JudgeTest, HasNoDoubtsAboutWhatIsFine) {
    EXPECT_THAT(after(1, {"gateway.plant", "127.0.0.1"}), IsEmpty());
}

TEST_F(JudgeTest, AnnouncesTheEnd14DaysBeforeAndNamesTheDay) {
    EXPECT_THAT(after(15), IsEmpty());
    EXPECT_THAT(after(17), ElementsAre(HasSubstr("the certificate in gateway.crt expires on " +
                                                 date_text(made + 30 * kDay - kHour) + ", in 1")));
    EXPECT_THAT(after(31), ElementsAre(HasSubstr("has expired")));
    EXPECT_THAT(after(-1), testing::Contains(HasSubstr("compare the clock")));
    EXPECT_THAT(after(400), testing::Contains(HasSubstr("the CA CN=Plant CA in ca.crt")));
}

TEST_F(JudgeTest, ComparesNamesAndPurpose) {
    EXPECT_THAT(after(1, {"other.plant", "10.0.0.1"}),
                ElementsAre(HasSubstr("is not for other.plant"), HasSubstr("is not for 10.0.0.1")));
    const Issued client = issue_client(plant.ca, "gateway.plant", "operator", valid());
    settings.material.certificate = client.certificate;
    EXPECT_THAT(after(1), ElementsAre(HasSubstr("is not one of a server")));
}

TEST_F(JudgeTest, SaysThatAListIsOverdue) {
    settings.crl = "crl.pem";
    settings.material.crl = revoke(plant.ca, "", plant.server.certificate, valid(1));
    EXPECT_THAT(after(2), ElementsAre(HasSubstr("is overdue since")));
    EXPECT_THAT(after(0), IsEmpty());
}

TEST_F(JudgeTest, ListsKeepWhatTheyHad) {
    const Issued one = issue_client(plant.ca, "one", {}, valid());
    const Issued two = issue_client(plant.ca, "two", {}, valid());
    const std::string first = revoke(plant.ca, "", one.certificate, valid());
    const std::string both = revoke(plant.ca, first, two.certificate, valid());
    EXPECT_GT(both.size(), first.size());
    EXPECT_EQ(revoke(plant.ca, both, two.certificate, valid()).size() / 40, both.size() / 40);
    EXPECT_THROW(revoke(plant.ca, "no list", one.certificate, valid()), CannotIssue);
    EXPECT_THROW(issue_server(one, {"x"}, valid()), CannotIssue);
    EXPECT_THROW(issue_server(plant.ca, {"a,DNS:b"}, valid()), CannotIssue);
}

}  // namespace
}  // namespace panelgate::tls::judge_test
