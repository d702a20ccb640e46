#include "panelgate/base/role.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::role_test {
namespace {

OwnRole own(std::string name, std::initializer_list<Right> rights) {
    OwnRole role{std::move(name), {}};
    for (const Right right : rights) role.rights.add(right);
    return role;
}

TEST(Role, ADefaultOneHasTheRightsOfThoseBeforeIt) {
    EXPECT_TRUE(rights_of(Role::none).empty());
    Rights all;
    for (const Right right : kAllRights) all.add(right);
    EXPECT_EQ(rights_of(Role::admin), all);
    EXPECT_TRUE(rights_of(Role::engineer).has(Right::raw));
    EXPECT_FALSE(rights_of(Role::engineer).has(Right::reload));
    EXPECT_FALSE(rights_of(Role::operator_).has(Right::broadcast));
    EXPECT_EQ(least_with(rights_of(Role::operator_)), Role::operator_);
}

TEST(Role, OneOfTheConfigurationHasWhatItListsAndNoMore) {
    const std::vector<OwnRole> roles{own("keeper", {Right::reload}), own("blind", {Right::write})};
    const Standing keeper = standing_named("keeper", roles);
    EXPECT_EQ(keeper.name(), "keeper");
    EXPECT_EQ(keeper.role, Role::admin) << "the least default one like it";
    EXPECT_TRUE(keeper.may(Right::reload));
    EXPECT_FALSE(keeper.may(Right::read));
    EXPECT_FALSE(standing_named("blind", roles).may(Right::read));
    EXPECT_EQ(standing_named("operator", roles), (Standing{Role::operator_, {}}));
}

TEST(Role, AnUnknownWordIsTheLeast) {
    for (const char* word : {"", "Keeper", "none", "default"})
        EXPECT_EQ(standing_named(word, {}), Standing{}) << word;
}

}  // namespace
}  // namespace panelgate::role_test
