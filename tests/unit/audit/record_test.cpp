#include "panelgate/audit/record.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace panelgate::audit {
namespace {

using namespace std::chrono_literals;

TEST(AuditRecord, KeepsTheOrderOfItsMembersAndLeavesOutEmptyTexts) {
    Members record = record_of("write", WallTime(1'700'000'000'123'456us));
    add_text(record, "station", "press");
    add_text(record, "token", "");
    add(record, {{"transaction", 42}, {"unclean", true}});
    EXPECT_EQ(body_of(record),
              R"("time":"2023-11-14T22:13:20.123Z","kind":"write","station":"press",)"
              R"("transaction":42,"unclean":true)");
}

TEST(AuditRecord, TextsOfClientsCannotEndAStringOrALine) {
    Members record;
    add_text(record, "path", "a\"b\\c\nd\x01 \xC3\xA9 \xFF");
    EXPECT_EQ(body_of(record), "\"path\":\"a\\\"b\\\\c\\nd\\u0001 \xC3\xA9 \xEF\xBF\xBD\"");
}

}  // namespace
}  // namespace panelgate::audit
