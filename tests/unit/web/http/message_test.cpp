// Messages and who sends them: targets, queries, callers; problems, JSON text and gzip.
#include "panelgate/web/http/message.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "beast_message.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web::message_test {
namespace {

namespace json = boost::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

TEST(Target, CutsAPathIntoSegmentsAndDecodesThem) {
    EXPECT_THAT(parse_target("/")->path, IsEmpty());
    EXPECT_THAT(parse_target("/a/b%20c/d%2Fe/f+g")->path, ElementsAre("a", "b c", "d/e", "f+g"));
    EXPECT_THAT(parse_target("/a//b/")->path, ElementsAre("a", "", "b"));
    EXPECT_TRUE(parse_target("/a//b/?c=d")->folder);
    EXPECT_FALSE(parse_target("/a//b?c=d/")->folder);
    EXPECT_THAT(parse_target("/%C3%A4?t=%E2%82%AC")->path, ElementsAre("\xC3\xA4"));
    for (const char* text : {"", "a", "ftp://x/", "http:/x", "*", "/%", "/%4", "/%4x", "/%%41",
                             "/% 1", "/a?b=%x",  // from here on: what is not UTF-8
                             "/%ff", "/a/%C3", "/\xFF", "/a?%80=1", "/a?b=%ED%A0%80", "/%C3/%A4"})
        EXPECT_FALSE(parse_target(text)) << text;
}

TEST(Target, ReadsAQueryAndKeepsOneThatComesTwice) {
    EXPECT_THAT(parse_target("/a?count=2&type=i16&&x&=y&z=1+2%3d")->query,
                ElementsAre(Pair("", "y"), Pair("count", "2"), Pair("type", "i16"), Pair("x", ""),
                            Pair("z", "1 2=")));
    EXPECT_THAT(parse_target("/a?&")->query, IsEmpty());
    EXPECT_THAT(parse_target("/a?count=2&type=i16&co%75nt=3")->query,
                ElementsAre(Pair("count", "2"), Pair("count", "3"), Pair("type", "i16")));
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

TEST(Query, TakesANumberWholeOrNotAtAllAndWithinItsBounds) {
    EXPECT_EQ(to_number("0"), 0u);
    EXPECT_EQ(to_number("007"), 7u);
    EXPECT_EQ(to_number("4294967295"), 4294967295u);
    EXPECT_EQ(to_number("fF", 16), 255u);
    for (const char* text : {"", " 1", "1 ", "+1", "-1", "1.0", "0x1", "4294967296", "a"})
        EXPECT_FALSE(to_number(text)) << text;
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

TEST(Caller, NotifiesEachHandlerOnceThatItHasLeft) {
    Caller caller(7, "10.0.0.7");
    int first = 0;
    int second = 0;
    EXPECT_TRUE(caller.at_leaving(&first, [&first] { ++first; }));
    EXPECT_FALSE(caller.at_leaving(&first, [&first] { first += 10; }));
    EXPECT_TRUE(caller.at_leaving(&second, [&] { second += caller.has_left() ? 1 : 0; }));
    EXPECT_FALSE(caller.has_left());
    caller.leave();
    caller.leave();
    EXPECT_TRUE(caller.has_left());
    EXPECT_EQ(first, 1);
    EXPECT_EQ(second, 1);
}

TEST(Caller, ThatHangsUpHasNotLeft) {
    Caller caller(7, "10.0.0.7");
    int told = 0;
    caller.at_leaving(&told, [&told] { ++told; });
    caller.hang_up();
    EXPECT_TRUE(caller.has_hung_up());
    EXPECT_FALSE(caller.has_left());
    caller.leave();
    EXPECT_TRUE(caller.has_left());
    EXPECT_EQ(told, 1);
}

TEST(Caller, IsCalledByItsAddressAndTheTokenOfItsLastRequest) {
    Caller caller(7, "10.0.0.9");
    EXPECT_EQ(caller.name(), "http 10.0.0.9");
    caller.identify("ops", {Role::operator_, {}}, "[::]:80");
    EXPECT_EQ(caller.name(), "http 10.0.0.9 token ops");
    caller.identify("", {Role::viewer, {}}, "[::]:80");
    EXPECT_EQ(caller.name(), "http 10.0.0.9");
    EXPECT_EQ(Caller(8, "").name(), "http");
}

TEST(Problem, IsFormattedAsInRfc9457) {
    const HttpResponse plain = to_response(problem(404, "there is no line 'x'"));
    EXPECT_EQ(plain.status, 404u);
    EXPECT_EQ(plain.content_type, "application/problem+json");
    EXPECT_EQ(plain.body,
              R"({"type":"urn:panelgate:problem:not-found","title":"Not Found","status":404,)"
              R"("detail":"there is no line 'x'"})"
              "\n");
    Problem made = problem(503, "later");
    made.kind = "busy";
    made.extensions["transmitted"] = false;
    made.headers.emplace_back("Retry-After", "1");
    const HttpResponse full = to_response(made);
    EXPECT_EQ(full.body, R"({"type":"urn:panelgate:problem:busy","title":"Service Unavailable",)"
                         R"("status":503,"detail":"later","transmitted":false})"
                         "\n");
    ASSERT_EQ(full.headers.size(), 1u);
    EXPECT_EQ(full.headers[0].first, "Retry-After");
}

TEST(Problem, HasATitleAndATypeForEveryStatusThatIsUsed) {
    for (const unsigned status : {400u, 401u, 403u, 404u, 405u, 409u, 413u, 415u, 421u, 422u, 429u,
                                  431u, 500u, 502u, 503u, 504u}) {
        const json::object told = json_of(problem(status, ""));
        EXPECT_GT(told.at("type").as_string().size(), std::string("urn:panelgate:problem:").size());
        EXPECT_FALSE(told.at("title").as_string().empty()) << status;
    }
}

TEST(JsonText, HasNumbersAsPeopleWriteThem) {
    EXPECT_EQ(json_text(json::array{29.5, 0.0, 100.0, -3276.8, 882.160956249, 1e-7}),
              "[29.5,0,100,-3276.8,882.160956249,1e-07]");
    EXPECT_EQ(json_text(json::array{-5, 18446744073709551615U, true, nullptr}),
              "[-5,18446744073709551615,true,null]");
    EXPECT_EQ(json_text(std::numeric_limits<double>::quiet_NaN()), "null");
    EXPECT_EQ(json_text(std::numeric_limits<double>::infinity()), "null");
}

TEST(JsonText, KeepsMembersInTheirOrderAndEscapesTexts) {
    const json::object object{{"b", json::array{}}, {"a", json::object{}}, {"\"", "x\n\\\x1f"}};
    EXPECT_EQ(json_text(object), R"({"b":[],"a":{},"\"":"x\n\\\u001f"})");
    EXPECT_EQ(json::parse(json_text(object)), json::value(object));
}

TEST(JsonText, AnExcerptIsShortAndCutsNoCharacterInTwo) {
    EXPECT_EQ(excerpt("7"), "7");
    const std::string long_one(79, 'x');
    EXPECT_EQ(excerpt(long_one + "\u00b0\u00b0"), long_one + "...");
}

std::string gunzip(std::string body) {
    z_stream z{};
    EXPECT_EQ(inflateInit2(&z, 15 + 16), Z_OK);
    std::string text(4'000'000, '\0');
    z.next_in = reinterpret_cast<Bytef*>(body.data());
    z.avail_in = static_cast<uInt>(body.size());
    z.next_out = reinterpret_cast<Bytef*>(text.data());
    z.avail_out = static_cast<uInt>(text.size());
    EXPECT_EQ(inflate(&z, Z_FINISH), Z_STREAM_END) << "whole, with the right CRC";
    EXPECT_EQ(z.avail_in, 0u);
    text.resize(z.total_out);
    inflateEnd(&z);
    return text;
}

TEST(Gzip, GivesBackWhatWentIn) {
    std::string text;
    for (int i = 0; i < 20'000; ++i)
        text += "panelgate_point_value{point=\"p" + std::to_string(i) + "\"} 7\n";
    const std::string body = packed(text);
    EXPECT_LT(body.size(), text.size() / 5);
    EXPECT_EQ(gunzip(body), text);
    EXPECT_EQ(unpacked(body), text);
    EXPECT_EQ(unpacked(body.substr(0, body.size() / 2)), "");
    EXPECT_EQ(unpacked("not packed"), "");
    EXPECT_EQ(unpacked(""), "");
    EXPECT_EQ(gunzip(packed("")), "");
}

TEST(AcceptsGzip, WhereItIsNamedAndNotRefused) {
    for (const char* header : {"gzip", "GZIP", "deflate, gzip;q=1.0, *;q=0.5", "br,gzip ; q=0.1"})
        EXPECT_TRUE(accepts_gzip(header)) << header;
    for (const char* header :
         {"", "identity", "deflate", "gzip;q=0", "gzip; q=0.000", "*", ",", ";"})
        EXPECT_FALSE(accepts_gzip(header)) << header;
}

}  // namespace
}  // namespace panelgate::web::message_test
