#include "panelgate/modbus/response.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "support/hex.hpp"
#include "support/request.hpp"

namespace panelgate::modbus::translation_test {
namespace {

Bytes sent_for(const Bytes& asked) {
    const auto other = translated(test::request_of(asked));
    return other ? other->pdu() : Bytes{};
}

TEST(Translation, ACoilIsWrittenAsOneOfSeveral) {
    EXPECT_EQ(sent_for("05 00 AC FF 00"_hex), "0F 00 AC 00 01 01 01"_hex);
    EXPECT_EQ(sent_for("05 FF FF 00 00"_hex), "0F FF FF 00 01 01 00"_hex);
}

TEST(Translation, AValueThatIsNoCoilsStaysWithItsFunction) {
    for (const Bytes& asked : {"05 00 AC 00 01"_hex, "05 00 AC FF 01"_hex, "05 00 AC 55 00"_hex})
        EXPECT_EQ(sent_for(asked), Bytes{}) << to_hex(asked);
}

TEST(Translation, ARegisterIsWrittenAsOneOfSeveral) {
    EXPECT_EQ(sent_for("06 00 64 12 34"_hex), "10 00 64 00 01 02 12 34"_hex);
}

TEST(Translation, InputsAreReadAsWhatShowsTheSame) {
    EXPECT_EQ(sent_for("02 01 20 00 05"_hex), "01 01 20 00 05"_hex);
    EXPECT_EQ(sent_for("04 00 64 00 05"_hex), "03 00 64 00 05"_hex);
}

TEST(Translation, NothingElseIsTranslated) {
    for (const Bytes& asked :
         {"01 00 00 00 01"_hex, "03 00 00 00 01"_hex, "07"_hex, "0F 00 00 00 01 01 01"_hex,
          "10 00 00 00 01 02 00 01"_hex, "16 00 04 00 F2 00 25"_hex,
          "17 00 00 00 01 00 00 00 01 02 00 01"_hex, "41 01"_hex})
        EXPECT_EQ(sent_for(asked), Bytes{}) << to_hex(asked);
}

TEST(Translation, AWriteIsConfirmedAsItWasAsked) {
    EXPECT_EQ(translated_back("05 00 AC FF 00"_hex, "0F 00 AC 00 01"_hex), "05 00 AC FF 00"_hex);
    EXPECT_EQ(translated_back("06 00 64 12 34"_hex, "10 00 64 00 01"_hex), "06 00 64 12 34"_hex);
}

TEST(Translation, AReadGivesItsValuesUnderItsOwnFunction) {
    EXPECT_EQ(translated_back("02 01 20 00 05"_hex, "01 01 19"_hex), "02 01 19"_hex);
    EXPECT_EQ(translated_back("04 00 64 00 01"_hex, "03 02 00 0A"_hex), "04 02 00 0A"_hex);
}

TEST(Translation, AnExceptionIsThatOfTheFunctionAsked) {
    EXPECT_EQ(translated_back("05 00 AC FF 00"_hex, "8F 02"_hex), "85 02"_hex);
    EXPECT_EQ(translated_back("06 00 64 12 34"_hex, "90 03"_hex), "86 03"_hex);
    EXPECT_EQ(translated_back("02 01 20 00 05"_hex, "81 01"_hex), "82 01"_hex);
    EXPECT_EQ(translated_back("04 00 64 00 01"_hex, "83 99"_hex), "84 99"_hex);
}

TEST(Translation, WhatComesBackAnswersWhatWasAsked) {
    for (const auto& [asked, reply] : {std::pair("05 00 AC FF 00"_hex, "0F 00 AC 00 01"_hex),
                                       std::pair("06 00 64 12 34"_hex, "90 02"_hex),
                                       std::pair("04 00 64 00 01"_hex, "03 02 00 0A"_hex)}) {
        ASSERT_TRUE(answers(sent_for(asked), reply));
        EXPECT_TRUE(answers(asked, translated_back(asked, reply)));
    }
}

}  // namespace
}  // namespace panelgate::modbus::translation_test
