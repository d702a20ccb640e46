#include "panelgate/web/http/problem.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string_view>

namespace panelgate::web::problem_test {
namespace {

TEST(Problem, IsFormattedAsInRfc9457) {
    const HttpResponse response = to_response(problem(404, "there is no line 'x'"));
    EXPECT_EQ(response.status, 404u);
    EXPECT_EQ(response.content_type, "application/problem+json");
    EXPECT_EQ(response.body,
              R"({"type":"urn:panelgate:problem:not-found","title":"Not Found","status":404,)"
              R"("detail":"there is no line 'x'"})"
              "\n");
}

TEST(Problem, HasATypeAndFurtherMembersAndHeadersWhereThereAreSome) {
    Problem made = problem(503, "later");
    made.kind = "busy";
    made.extensions["transmitted"] = false;
    made.headers.emplace_back("Retry-After", "1");
    const HttpResponse response = to_response(made);
    EXPECT_EQ(response.body,
              R"({"type":"urn:panelgate:problem:busy","title":"Service Unavailable",)"
              R"("status":503,"detail":"later","transmitted":false})"
              "\n");
    ASSERT_EQ(response.headers.size(), 1u);
    EXPECT_EQ(response.headers[0].first, "Retry-After");
}

TEST(Problem, HasATitleForEveryStatusThatIsUsed) {
    for (const unsigned status :
         {400u, 401u, 403u, 404u, 405u, 413u, 415u, 422u, 431u, 500u, 502u, 503u, 504u}) {
        EXPECT_EQ(to_response(problem(status, "")).body.find(R"("title":"Error")"),
                  std::string::npos)
            << status;
    }
}

TEST(Problem, HasATypeOfItsOwnForEachKindOfError) {
    std::set<std::string_view> words;
    for (const ProblemKind& kind : problem_kinds()) {
        EXPECT_TRUE(words.insert(kind.word).second) << kind.word;
        EXPECT_TRUE(kind.meaning.ends_with('.')) << kind.word;
    }
    for (const unsigned status : {400u, 401u, 403u, 404u, 405u, 409u, 413u, 415u, 421u, 422u, 431u,
                                  500u, 502u, 503u, 504u}) {
        EXPECT_EQ(std::ranges::count(problem_kinds(), status, &ProblemKind::of_status), 1)
            << status;
    }
}

}  // namespace
}  // namespace panelgate::web::problem_test
