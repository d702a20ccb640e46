// What is written and read as text: numbers, characters, words, addresses, and labels.
#include "panelgate/base/text.hpp"

#include <gtest/gtest.h>

#include <compare>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/base/words.hpp"

namespace panelgate::text_test {
namespace {

/// The texts of all numbers, apart by blanks.
template <class Number>
std::string texts(std::initializer_list<Number> numbers) {
    std::string all;
    for (const Number number : numbers) all += (all.empty() ? "" : " ") + number_text(number);
    return all;
}

TEST(NumberText, IsTheShortestDecimal) {
    EXPECT_EQ(texts({29.5, -3276.8, 0.1 + 0.2, 882.160956249}),
              "29.5 -3276.8 0.30000000000000004 882.160956249");
    // Whole numbers have no point, and zero has no sign.
    EXPECT_EQ(texts({100.0, 100000.0, -1e15, 0.0, -0.0}), "100 100000 -1000000000000000 0 0");
    // An exponent only where digits would be zeros.
    EXPECT_EQ(texts({0.0001, 0.00001, 1e16}), "0.0001 1e-05 1e+16");
    EXPECT_EQ(number_text(1.7976931348623157e308), "1.7976931348623157e+308");
    // What is not finite has no text.
    EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "");
    EXPECT_EQ(number_text(std::numeric_limits<double>::quiet_NaN()), "");
}

TEST(NumberText, AFloatHasItsOwnDigits) {
    EXPECT_EQ(texts({0.1F, 3.4028235e38F}), "0.1 3.4028235e+38");
    EXPECT_EQ(as_printed(0.1F), 0.1);
    EXPECT_EQ(as_printed(-2147483648.0F), -2147483648.0) << "whole ones stay exact";
    EXPECT_EQ(static_cast<float>(as_printed(1.17549435e-38F)), 1.17549435e-38F);
}

Decimal of(const char* text) { return Decimal::parse(text).value(); }

TEST(Decimal, IsTheSameNumberHoweverItIsWritten) {
    for (const char* text : {"1500", "1.5e3", "1500.000", "0.0015E+6", "+15e2", "001500", "1500."})
        EXPECT_EQ(of(text), Decimal(1500)) << text;
    EXPECT_EQ(of("-0.0"), Decimal());
    EXPECT_EQ(of("0.1"), Decimal(0.1)) << "the shortest digits of the double";
    EXPECT_NE(of("0.1"), Decimal::exactly(0.1));
    EXPECT_EQ(of("18446744073709551616"), Decimal::exactly(0x1p64));
    for (const char* text : {"", "-", ".", "e5", "1e", "1e401", "1e-401", "1e99999999999", "x",
                             "1x", "--1", "1.2.3", "inf", "nan", "0x1"})
        EXPECT_FALSE(Decimal::parse(text)) << text;
}

TEST(Decimal, IsWrittenAsPeopleDoWithAllItsDigits) {
    for (const char* text :
         {"0", "-1", "100", "21.5", "0.0001", "1e-05", "-1.25e-07", "1e+16", "9007199254740.993",
          "18014398509481986", "-18446744073709551616", "3.4028235e+38", "1234567.00000000001"})
        EXPECT_EQ(of(text).text(), text);
    EXPECT_EQ(Decimal(std::numeric_limits<std::int64_t>::min()).text(), "-9223372036854775808");
}

TEST(Decimal, IsAnIntegerWhereItFits) {
    EXPECT_EQ(of("-9223372036854775808").as_int64(), std::numeric_limits<std::int64_t>::min());
    EXPECT_EQ(of("9223372036854775808").as_int64(), std::nullopt);
    EXPECT_EQ(of("0.5").as_int64(), std::nullopt);
    EXPECT_EQ(of("1.8446744073709551615e19").as_uint64(),
              std::numeric_limits<std::uint64_t>::max());
    for (const char* text : {"18446744073709551616", "1e300", "-1"})
        EXPECT_EQ(of(text).as_uint64(), std::nullopt) << text;
    EXPECT_EQ(Decimal().as_uint64(), 0u);
    EXPECT_EQ(of("9007199254740993").nearest(), 9007199254740992.0);
}

TEST(Decimal, IsOrdered) {
    const char* const rising[] = {
        "-1e300", "-100", "-99.9", "-1", "-0.01",  "0",  "0.0099",           "0.01",
        "0.1",    "1",    "9.99",  "10", "10.001", "11", "9007199254740993", "1e300"};
    for (std::size_t low = 0; low < std::size(rising); ++low) {
        for (std::size_t high = 0; high < std::size(rising); ++high)
            EXPECT_EQ(of(rising[low]) <=> of(rising[high]), low <=> high)
                << rising[low] << ' ' << rising[high];
    }
    EXPECT_LT(of("9007199254740992"), of("9007199254740993"));
    EXPECT_GT(of("-9223372036854775807"), of("-9223372036854775808"));
    const std::string many = "2." + std::string(200, '0');
    EXPECT_EQ(of((many + "0").c_str()), Decimal(2));
    EXPECT_GT(of((many + "1").c_str()), Decimal(2)) << "there is more behind its last digit";
}

TEST(Decimal, IsMultipliedAndAddedExactly) {
    EXPECT_EQ(Decimal(3) * Decimal(0.1), of("0.3"));
    EXPECT_EQ(of("9007199254740993") * of("-0.001"), of("-9007199254740.993"));
    EXPECT_EQ(Decimal(0) * of("-5"), Decimal());
    EXPECT_EQ(of("1e300") + of("1e-300") + -of("1e300"), of("1e-300"));
    EXPECT_EQ(of("0.1") + of("-0.1"), Decimal());
}

TEST(Decimal, IsDividedIntoTheWholeNumbersAround) {
    const auto is = [](const char* number, const char* by, int below, int nearest, int above) {
        const auto around = of(number).divided_by(of(by));
        EXPECT_EQ(around.below, Decimal(below)) << number << " / " << by;
        EXPECT_EQ(around.nearest, Decimal(nearest)) << number << " / " << by;
        EXPECT_EQ(around.above, Decimal(above)) << number << " / " << by;
    };
    is("21.5", "0.1", 215, 215, 215);
    is("21.54", "0.1", 215, 215, 216);
    is("25", "10", 2, 3, 3);
    is("-25", "10", -3, -3, -2);
    is("-24", "10", -3, -2, -2);
    is("24", "-10", -3, -2, -2);
    is("0.25", "1", 0, 0, 1);
    is("-0.25", "1", -1, 0, 0);
    is("0", "-3", 0, 0, 0);
}

TEST(Utf8, KnowsWhatIsText) {
    for (const char* text : {"", "plain", "\xC3\xA4", "\xE2\x82\xAC", "\xF0\x9F\x94\xA7",
                             "a\xC2\xA0z", "\xED\x9F\xBF", "\xF4\x8F\xBF\xBF"})
        EXPECT_TRUE(is_utf8(text)) << text;
    for (const char* text :
         {"\xFF", "\x80", "a\xC3", "\xC3z", "\xC0\xAF", "\xE0\x80\xAF", "\xED\xA0\x80",
          "\xF0\x80\x80\x80", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xE2\x82"})
        EXPECT_FALSE(is_utf8(text));
    EXPECT_EQ(utf8_sequence("\xE2\x82\xAC!"), 3u) << "the sequence at the beginning";
    EXPECT_EQ(utf8_sequence("x\xFF"), 1u);
    EXPECT_EQ(utf8_sequence("\xFFx"), 0u);
}

TEST(Utf8, PutsASignForEveryByteThatIsNoText) {
    EXPECT_EQ(as_utf8("caf\xC3\xA9"), "caf\xC3\xA9");
    EXPECT_EQ(as_utf8("caf\xE9.yaml"), "caf\uFFFD.yaml");
    EXPECT_EQ(as_utf8("\xE2\x82"), "\uFFFD\uFFFD");
}

constexpr std::string_view kKeys[] = {"baud", "parity", "stop_bits", "reply_timeout", "retries"};

TEST(Nearest, FindsWhatWasProbablyMeant) {
    EXPECT_EQ(nearest("baud", kKeys), "baud") << "the word itself";
    EXPECT_EQ(nearest("bauds", kKeys), "baud") << "one letter more";
    EXPECT_EQ(nearest("parit", kKeys), "parity") << "one letter less";
    EXPECT_EQ(nearest("stop-bits", kKeys), "stop_bits") << "another letter";
    EXPECT_EQ(nearest("reply_timoeut", kKeys), "reply_timeout") << "two swapped";
    EXPECT_EQ(nearest("reply_time_outs", kKeys), "reply_timeout") << "two edits";
    constexpr std::string_view kAlike[] = {"retries", "retry"};
    EXPECT_EQ(nearest("retrie", kAlike), "retries") << "the nearer of two";
    EXPECT_EQ(nearest("retr", kAlike), "retry");
}

TEST(Nearest, ReturnsNothingIfNoneIsNear) {
    EXPECT_EQ(nearest("address", kKeys), "");
    EXPECT_EQ(nearest("reply_tmt", kKeys), "") << "four edits";
    EXPECT_EQ(nearest("", kKeys), "");
    EXPECT_EQ(nearest("baud", {}), "");
    constexpr std::string_view kShort[] = {"id", "unit"};
    EXPECT_EQ(nearest("ip", kShort), "") << "half of it is wrong";
    EXPECT_EQ(nearest("unti", kShort), "unit");
}

TEST(Nearest, KnowsOtherSpellingsAndSynonymsOfOtherIndustries) {
    constexpr std::string_view kSpelt[] = {"panasonic-gt", "data_bits", "info"};
    EXPECT_EQ(nearest("Panasonic GT", kSpelt), "panasonic-gt");
    EXPECT_EQ(nearest("dataBits", kSpelt), "data_bits");
    EXPECT_EQ(nearest("INFO", kSpelt), "info");
    constexpr std::string_view kOurs[] = {"baud", "i16", "f32", "none", "warn"};
    EXPECT_EQ(nearest("baudrate", kOurs), "baud");
    EXPECT_EQ(nearest("int16", kOurs), "i16");
    EXPECT_EQ(nearest("FLOAT", kOurs), "f32");
    EXPECT_EQ(nearest("N", kOurs), "none");
    EXPECT_EQ(nearest("warning", kOurs), "warn");
    EXPECT_EQ(nearest("double", kOurs), "") << "nobody here has f64";
}

TEST(HostKey, IsAnIpv4AddressOrAnIpv6Network) {
    EXPECT_EQ(HostKey("10.0.0.7").text(), "10.0.0.7");
    EXPECT_EQ(HostKey("::ffff:10.0.0.7"), HostKey("10.0.0.7"));
    EXPECT_NE(HostKey("::ffff:10.0.0.8"), HostKey("10.0.0.7"));
    EXPECT_EQ(HostKey("2001:db8:1:2:3:4:5:6").text(), "2001:db8:1:2::/64");
    EXPECT_EQ(HostKey("2001:db8:1:2:ffff::1"), HostKey("2001:db8:1:2::9"));
    EXPECT_NE(HostKey("2001:db8:1:3::9"), HostKey("2001:db8:1:2::9"));
    EXPECT_EQ(HostKey("fe80::1%eth0").text(), "fe80::/64");
    EXPECT_EQ(HostKey("::1").text(), "::1");
    EXPECT_EQ(HostKey("").text(), "");
    EXPECT_EQ(HostKey("/dev/ttyUSB0").text(), "/dev/ttyUSB0");
}

TEST(NameOfHost, IsTheSameForAllConnectionsOfAHost) {
    EXPECT_EQ(name_of_host("10.0.0.7:50000"), "10.0.0.7");
    EXPECT_EQ(name_of_host("[::1]:50000"), "::1");
    EXPECT_EQ(name_of_host("modbus_tcp 10.0.0.7:50000"), "modbus_tcp 10.0.0.7");
    EXPECT_EQ(name_of_host("modbus_tcp [2001:db8::9]:5"), "modbus_tcp 2001:db8::/64");
    EXPECT_EQ(name_of_host("http 2001:db8::12 token bob"), "http 2001:db8::/64 token bob");
    for (const char* whole : {"http ::1 token bob", "mqtt", "", "http 10.0.0.9 token a:1",
                              "poll of 10.0.0.7", "relay 1.2.3.4/UW0 to oven/GDT1"})
        EXPECT_EQ(name_of_host(whole), whole);
}

TEST(AddressIn, IsTheFirstOrTheSecondWord) {
    EXPECT_EQ(address_in("modbus_tcp 10.0.0.7:51234"), "10.0.0.7");
    EXPECT_EQ(address_in("modbus_tcp [::1]:51234"), "::1");
    EXPECT_EQ(address_in("http 10.0.0.9 token ops"), "10.0.0.9");
    EXPECT_EQ(address_in("http fe80::1 token ops"), "fe80::1");
    EXPECT_EQ(address_in("http 2001:db8::/64 token ops"), "2001:db8::/64");
    for (const char* none : {"poll of press", "http", "", "relay press/UW0 to oven/GDT1"})
        EXPECT_EQ(address_in(none), "");
}

/// Labels of the first `count` enumerators, in order, separated by commas.
template <class Enum>
std::string words(std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i)
        text.append(i == 0 ? "" : ",").append(label(static_cast<Enum>(i)));
    return text;
}

TEST(Words, AreThoseOfMetricsRestAndTheTrace) {
    EXPECT_EQ(words<Outcome>(kAllOutcomes.size()),
              "ok,exception,timeout,damaged,refused,busy,expired,cancelled,offline,line_down,"
              "cached,shared");
    for (std::size_t i = 0; i < kAllOutcomes.size(); ++i)
        EXPECT_EQ(static_cast<std::size_t>(kAllOutcomes[i]), i) << "counted by its place";
    EXPECT_EQ(words<PriorityClass>(kPriorityClasses), "write,read,poll,probe");
    EXPECT_EQ(words<Health>(5), "unknown,online,suspect,heard,offline");
    EXPECT_EQ(words<EchoState>(3), "unknown,absent,present");
    EXPECT_EQ(words<FrameKind>(13),
              "request,retry,probe,learn echo,broadcast,reply,heard request,damaged,echo,"
              "foreign request,late,copy,foreign");
    EXPECT_EQ(words<FrameDirection>(3), "sent,received,discarded");
}

TEST(Words, AFrameIsSentReceivedOrDiscardedByWhatItIs) {
    EXPECT_EQ(direction_of(FrameKind::probe), FrameDirection::sent);
    EXPECT_EQ(direction_of(FrameKind::reply), FrameDirection::received);
    EXPECT_EQ(direction_of(FrameKind::late), FrameDirection::discarded);
}

TEST(OutcomeCounts, CountEachOutcomeByItself) {
    OutcomeCounts counts;
    ++counts[Outcome::shared];
    ++counts[Outcome::shared];
    EXPECT_EQ(counts[Outcome::shared], 2u);
    EXPECT_EQ(counts[Outcome::ok], 0u);
}

TEST(Fault, HasAWordOfItsOwnAndAnOutcomeOfTheMetric) {
    const std::set<std::string_view> outcomes = {"timeout", "damaged", "refused",   "busy",
                                                 "expired", "offline", "cancelled", "line_down"};
    std::set<std::string_view> labels;
    std::set<std::string_view> used;
    for (const Fault fault : kAllFaults) {
        labels.insert(label(fault));
        used.insert(label(outcome_of(fault)));
    }
    EXPECT_EQ(labels.size(), std::size(kAllFaults));
    EXPECT_EQ(used, outcomes);
    EXPECT_EQ(label(Fault::line_down), "line_down");
    for (const Fault fault : {Fault::denied, Fault::malformed, Fault::not_routed})
        EXPECT_EQ(outcome_of(fault), Outcome::refused) << "never routed";
    EXPECT_EQ(outcome_of(Fault::line_lost), Outcome::line_down);
}

TEST(Fault, ThrowsWhenAValueIsAskedForThatIsNotThere) {
    const Result<int> result = Fault::timeout;
    EXPECT_THROW(static_cast<void>(result.value()), std::logic_error);
    EXPECT_EQ(result.error(), Fault::timeout);
}

}  // namespace
}  // namespace panelgate::text_test
