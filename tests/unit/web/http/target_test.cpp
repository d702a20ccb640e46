#include "beast_message.hpp"

#include <gmock/gmock.h>

namespace panelgate::web::target_test {
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

TEST(Target, KeepsAQueryThatComesTwice) {
    EXPECT_THAT(parse_target("/a?count=2&type=i16&co%75nt=3")->query,
                ElementsAre(Pair("count", "2"), Pair("count", "3"), Pair("type", "i16")));
}

TEST(Target, RefusesWhatItCannotDecode) {
    for (const char* text :
         {"", "a", "ftp://x/", "http:/x", "*", "/%", "/%4", "/%4x", "/%%41", "/% 1", "/a?b=%x"}) {
        EXPECT_FALSE(parse_target(text)) << text;
    }
}

TEST(Target, RefusesWhatIsNotUtf8) {
    for (const char* text : {"/%ff", "/a/%C3", "/\xFF", "/a?%80=1", "/a?b=%ED%A0%80", "/%C3/%A4"}) {
        EXPECT_FALSE(parse_target(text)) << text;
    }
    EXPECT_THAT(parse_target("/%C3%A4?t=%E2%82%AC")->path, ElementsAre("\xC3\xA4"));
}

TEST(Target, UnderstandsTheAbsoluteForm) {
    const auto target = parse_target("HTTP://gateway:8080/a/b?x=1");
    ASSERT_TRUE(target);
    EXPECT_EQ(target->authority, "gateway:8080");
    EXPECT_THAT(target->path, ElementsAre("a", "b"));
    EXPECT_THAT(target->query, ElementsAre(Pair("x", "1")));
    for (const char* text : {"http://gateway", "https://gateway/", "http://gateway?x=1"}) {
        ASSERT_TRUE(parse_target(text)) << text;
        EXPECT_EQ(parse_target(text)->authority, "gateway") << text;
        EXPECT_THAT(parse_target(text)->path, IsEmpty()) << text;
    }
    EXPECT_EQ(parse_target("/a")->authority, std::nullopt);
}

}  // namespace
}  // namespace panelgate::web::target_test
