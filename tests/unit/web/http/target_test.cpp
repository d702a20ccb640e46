#include "target.hpp"

#include <gmock/gmock.h>

namespace panelgate::web {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

TEST(Target, CutsAPathIntoSegmentsAndDecodesThem) {
    EXPECT_THAT(parse_target("/")->path, IsEmpty());
    EXPECT_THAT(parse_target("/a/b%20c/d%2Fe/f+g")->path, ElementsAre("a", "b c", "d/e", "f+g"));
    EXPECT_THAT(parse_target("/a//b/")->path, ElementsAre("a", "", "b"));
}

TEST(Target, ReadsAQuery) {
    EXPECT_THAT(parse_target("/a?count=2&type=i16&&x&=y&z=1+2%3d")->query,
                ElementsAre(Pair("", "y"), Pair("count", "2"), Pair("type", "i16"), Pair("x", ""),
                            Pair("z", "1 2=")));
    EXPECT_THAT(parse_target("/a?&")->query, IsEmpty());
}

TEST(Target, TellsAQueryThatComesTwice) {
    EXPECT_EQ(parse_target("/a?count=2&type=i16")->repeated_query, "");
    EXPECT_EQ(parse_target("/a?count=2&type=i16&co%75nt=2")->repeated_query, "count");
}

TEST(Target, RefusesWhatItCannotDecode) {
    for (const char* text :
         {"", "a", "http://x/", "*", "/%", "/%4", "/%4x", "/%%41", "/% 1", "/a?b=%x"}) {
        EXPECT_FALSE(parse_target(text)) << text;
    }
}

}  // namespace
}  // namespace panelgate::web
