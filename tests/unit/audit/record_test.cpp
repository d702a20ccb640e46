#include "panelgate/audit/record.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <string>
#include <vector>

namespace panelgate::audit {
namespace {

using namespace std::chrono_literals;

WallTime at(std::chrono::microseconds since) { return WallTime(since); }

TEST(AuditRecord, IsComposedInTheOrderOfItsMembers) {
    Composer composer;
    const std::array<std::uint16_t, 3> values{0, 10, 65535};
    composer.begin(at(1'700'000'000'123'456us), Kind::write)
        .text("station", "press")
        .text("token", "")
        .number("transaction", 42)
        .numbers("values", values)
        .flag("unclean", true)
        .hex("pdu", std::array<std::uint8_t, 2>{0x06, 0xAB});
    EXPECT_EQ(composer.body(),
              R"("time":"2023-11-14T22:13:20.123Z","kind":"write","station":"press",)"
              R"("transaction":42,"values":[0,10,65535],"unclean":true,"pdu":"06ab")");
}

TEST(AuditRecord, TextsOfClientsCannotEndAString) {
    std::string out;
    append_json(out, "a\"b\\c\nd\x7f\x01 \xC3\xA9 \xFF");
    EXPECT_EQ(out, "\"a\\\"b\\\\c\\u000ad\\u007f\\u0001 \xC3\xA9 \xEF\xBF\xBD\"");
}

TEST(AuditRecord, ListsOfTextsAreEscapedOneByOne) {
    Composer composer;
    const std::vector<std::string> changes{"a \"b\"", "c"};
    composer.begin(at(0us), Kind::reload).texts("changes", changes);
    EXPECT_EQ(composer.body(), R"("time":"1970-01-01T00:00:00.000Z","kind":"reload",)"
                               R"("changes":["a \"b\"","c"])");
}

TEST(AuditRecord, TheNextOneForgetsTheLastAndTimeMayGoBack) {
    Composer composer;
    composer.begin(at(2'000'000us), Kind::start).text("version", "1.0.0");
    composer.begin(at(1'999'000us), Kind::end);
    EXPECT_EQ(composer.body(), R"("time":"1970-01-01T00:00:01.999Z","kind":"end")");
}

}  // namespace
}  // namespace panelgate::audit
