#include "panelgate/base/text.hpp"

#include <gtest/gtest.h>

namespace panelgate::utf8_test {
namespace {

TEST(Utf8, KnowsWhatIsText) {
    for (const char* text : {"", "plain", "\xC3\xA4", "\xE2\x82\xAC", "\xF0\x9F\x94\xA7",
                             "a\xC2\xA0z", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"}) {
        EXPECT_TRUE(is_utf8(text)) << text;
    }
}

TEST(Utf8, KnowsWhatIsNone) {
    for (const char* text :
         {"\xFF", "\x80", "a\xC3", "\xC3z", "\xC0\xAF", "\xE0\x80\xAF", "\xED\xA0\x80",
          "\xF0\x80\x80\x80", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xE2\x82"}) {
        EXPECT_FALSE(is_utf8(text));
    }
}

TEST(Utf8, MeasuresTheSequenceAtTheBeginning) {
    EXPECT_EQ(utf8_sequence("\xE2\x82\xAC!"), 3u);
    EXPECT_EQ(utf8_sequence("x\xFF"), 1u);
    EXPECT_EQ(utf8_sequence("\xFFx"), 0u);
}

TEST(Utf8, PutsASignForEveryByteThatIsNoText) {
    EXPECT_EQ(as_utf8("caf\xC3\xA9"), "caf\xC3\xA9");
    EXPECT_EQ(as_utf8("caf\xE9.yaml"), "caf\uFFFD.yaml");
    EXPECT_EQ(as_utf8("\xE2\x82"), "\uFFFD\uFFFD");
}

}  // namespace
}  // namespace panelgate::utf8_test
