#include "panelgate/web/http/query.hpp"

#include <gtest/gtest.h>

namespace panelgate::web::query_test {
namespace {

TEST(Query, TakesANumberWholeOrNotAtAll) {
    EXPECT_EQ(to_number("0"), 0u);
    EXPECT_EQ(to_number("007"), 7u);
    EXPECT_EQ(to_number("4294967295"), 4294967295u);
    EXPECT_EQ(to_number("fF", 16), 255u);
    for (const char* text : {"", " 1", "1 ", "+1", "-1", "1.0", "0x1", "4294967296", "a"}) {
        EXPECT_FALSE(to_number(text)) << text;
    }
}

TEST(Query, GivesAValueWithinItsBounds) {
    HttpRequest request;
    request.query = {{"last", "10"}};
    EXPECT_EQ(*query_number(request, "last", 1, 10, 5), 10u);
    EXPECT_EQ(*query_number(request, "first", 1, 10, 5), 5u);
    const auto beyond = query_number(request, "last", 1, 9, 5);
    ASSERT_FALSE(beyond);
    EXPECT_EQ(beyond.error().status, 400u);
    EXPECT_EQ(beyond.error().detail, "last must be a whole number from 1 to 9");
    request.query = {{"last", ""}};
    EXPECT_FALSE(query_number(request, "last", 0, 10, 5));
}

TEST(Query, UnknownAndRepeatedQueriesAreRefused) {
    const std::string_view known[] = {"count", "type"};
    HttpRequest request;
    EXPECT_FALSE(check_queries(request, {}));
    request.query = {{"count", "1"}};
    EXPECT_FALSE(check_queries(request, known));
    EXPECT_EQ(check_queries(request, {}).value().detail,
              "unknown query 'count'; there is none here");
    request.query.emplace("count", "1");
    EXPECT_EQ(check_queries(request, known).value().detail, "the query 'count' is given twice");
    request.query = {{"cuont", "1"}};
    EXPECT_EQ(check_queries(request, known).value().status, 400u);
    EXPECT_EQ(check_queries(request, known).value().detail,
              "unknown query 'cuont'; did you mean 'count'?");
    request.query = {{"address", "1"}};
    EXPECT_EQ(check_queries(request, known).value().detail,
              "unknown query 'address'; known here: count, type");
}

}  // namespace
}  // namespace panelgate::web::query_test
