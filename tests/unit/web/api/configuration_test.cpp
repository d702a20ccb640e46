#include <memory>
#include <string>

#include "http_rig.hpp"

namespace panelgate::web::configuration_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Configuration = HttpRig;

TEST_F(Configuration, IsShownWithThePathsAndTheRoleOfWhoAsks) {
    configuration = std::make_shared<const std::string>(R"({"lines":[]})");
    settings.anonymous = Role::viewer;
    settings.tokens = {{"ops", Role::operator_, "let-me"}};
    const Reply mine = get("/api/v1/configuration");
    EXPECT_EQ(mine.at("role"), "viewer");
    EXPECT_EQ(mine.at("version"), "1.2.3");
    EXPECT_EQ(mine.at("configuration"), json_of(R"({"lines":[]})"));
    const auto routes = mine.at("rest").as_array();
    EXPECT_THAT(routes, ::testing::Contains(
                            json_of(R"({"method":"GET","path":"/api/v1/lines","role":"viewer"})")));
    const Reply theirs =
        ask("GET", "/api/v1/configuration", "", "Authorization: Bearer let-me\r\n");
    EXPECT_EQ(theirs.at("role"), "operator");
    EXPECT_THAT(theirs.body(), Not(HasSubstr("let-me")));
}

TEST_F(Configuration, IsNotShownByAProgramWithout) {
    EXPECT_EQ(get("/api/v1/configuration").status(), 404u);
}

}  // namespace
}  // namespace panelgate::web::configuration_test
