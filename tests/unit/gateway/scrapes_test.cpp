#include "panelgate/gateway/scrapes.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::gateway::scrapes_test {
namespace {

using ::testing::HasSubstr;

class ScrapesTest : public testing::Test {
  protected:
    struct Client {
        std::optional<web::SharedText> got;
        std::string text() const { return got && *got ? **got : ""; }
        bool is_refused() const { return got && *got == nullptr; }
    };

    ScrapesTest() { with({}); }
    void with(Scrapes::Settings settings) {
        const auto begin = [this] {
            ++copies;
            return [this, left = 4](metrics::Snapshot& into) mutable {
                into.version = "copy" + std::to_string(copies);
                ++pieces;
                return --left > 0;
            };
        };
        scrapes = std::make_unique<Scrapes>(io.get_executor(), begin, settings);
    }
    Client& ask(std::uint64_t caller, bool gzip = false) {
        clients.push_back(std::make_unique<Client>());
        Client& client = *clients.back();
        scrapes->scrape(caller, gzip, [&client](web::SharedText text) {
            EXPECT_FALSE(client.got) << "answered twice";
            client.got = std::move(text);
        });
        EXPECT_FALSE(client.got) << "answered from inside the call";
        return client;
    }
    /// The same, and some pieces are copied.
    Client& ask_and_copy(std::uint64_t caller, int count) {
        Client& client = ask(caller);
        io.restart();
        while (pieces < count && io.run_one() > 0) {
        }
        return client;
    }
    void run() {
        io.restart();
        io.run();
    }

    boost::asio::io_context io{1};
    int copies = 0;
    int pieces = 0;
    std::vector<std::unique_ptr<Client>> clients;
    std::unique_ptr<Scrapes> scrapes;
};

TEST_F(ScrapesTest, HandsOutTheTextOfAllFigures) {
    const Client& client = ask(1);
    run();
    EXPECT_EQ(pieces, 4);
    EXPECT_THAT(client.text(), HasSubstr("panelgate_build_info{version=\"copy1\"} 1\n"));
    EXPECT_THAT(client.text(), HasSubstr("\nprocess_resident_memory_bytes "));
}

TEST_F(ScrapesTest, OthersHaveTheirTurnBetweenPieces) {
    ask(1);
    io.restart();
    std::vector<int> seen;
    for (int i = 0; i < 4; ++i) {
        boost::asio::post(io, [&] { seen.push_back(pieces); });
        const int before = pieces;
        while (pieces == before) io.run_one();
    }
    EXPECT_EQ(seen, (std::vector{1, 2, 3})) << "one turn behind each piece";
    run();
}

TEST_F(ScrapesTest, NobodyGetsFiguresOlderThanItsRequestAndThoseWhoWaitShareTheNextText) {
    const Client& first = ask_and_copy(1, 1);
    const Client& second = ask(2);
    const Client& third = ask(3);
    const Client& packed = ask(4, true);
    run();
    EXPECT_EQ(copies, 2);
    EXPECT_THAT(first.text(), HasSubstr("copy1"));
    EXPECT_THAT(second.text(), HasSubstr("copy2"));
    ASSERT_TRUE(second.got && third.got);
    EXPECT_EQ(*second.got, *third.got);
    EXPECT_THAT(packed.text(), testing::StartsWith("\x1f\x8b"));
    EXPECT_LT(packed.text().size(), second.text().size() / 2);
}

TEST_F(ScrapesTest, WhoLeavesIsHandedNothingAndNothingMoreIsMadeForIt) {
    const Client& first = ask_and_copy(1, 2);
    scrapes->cancel(1);
    scrapes->cancel(99);
    const Client& second = ask(2);
    run();
    EXPECT_TRUE(first.is_refused());
    EXPECT_THAT(second.text(), HasSubstr("copy2"));
    EXPECT_EQ(pieces, 2 + 4);
}

TEST_F(ScrapesTest, WhoWaitsForTheNextTextMayLeave) {
    const Client& first = ask_and_copy(1, 1);
    const Client& second = ask(2);
    scrapes->cancel(2);
    run();
    EXPECT_EQ(copies, 1);
    EXPECT_THAT(first.text(), HasSubstr("copy1"));
    EXPECT_TRUE(second.is_refused());
}

TEST_F(ScrapesTest, AQueueThatIsFullTakesNobodyElse) {
    with({.waiting = 1});
    ask(1);
    const Client& second = ask(2);
    const Client& third = ask(3);
    run();
    EXPECT_NE(second.text(), "");
    EXPECT_TRUE(third.is_refused());
}

TEST_F(ScrapesTest, TextsThatAreStillBeingSentAreBounded) {
    with({.sending_bytes = 1});
    Client& slow = ask(1);
    run();
    const Client& refused = ask(2);
    run();
    EXPECT_TRUE(refused.is_refused());
    slow.got.reset();
    const Client& third = ask(3);
    run();
    EXPECT_NE(third.text(), "");
}

TEST_F(ScrapesTest, MayEndInTheMiddle) {
    ask_and_copy(1, 4);
    scrapes.reset();
    run();
}

}  // namespace
}  // namespace panelgate::gateway::scrapes_test
