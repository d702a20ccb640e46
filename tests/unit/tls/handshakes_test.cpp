#include "panelgate/tls/handshakes.hpp"

#include <gtest/gtest.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <list>
#include <numeric>
#include <string>
#include <vector>

#include "tls_rig.hpp"

namespace panelgate::tls::handshakes_test {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

std::uint64_t count(const Handshakes& all, Outcome outcome) {
    return all.counters().handshakes[static_cast<std::size_t>(outcome)];
}

class HandshakesTest : public ::testing::Test {
  protected:
    void serve(const Settings& settings) {
        handshakes = std::make_shared<Handshakes>(io.get_executor(), "127.0.0.1:802", settings);
    }
    /// Begins one; a stream that is let in is in `streams` then.
    void begin(asio::ip::tcp::socket socket) {
        handshakes->begin(std::move(socket),
                          [this](Stream stream) { streams.emplace_back(std::move(stream)); });
    }
    std::size_t ended() const {
        const auto counts = handshakes->counters().handshakes;
        return std::accumulate(counts.begin(), counts.end(), std::size_t{});
    }
    void run_until(std::size_t count) {
        while (ended() < count) {
            io.restart();
            io.run_one();
        }
    }
    /// What a client of this identity gets.
    Outcome outcome_for(const Issued& identity) {
        Sockets sockets(io);
        TestClient client(identity);
        sockets.client.native_non_blocking(false);
        std::thread thread([&] {
            if (client.connect(sockets.client.native_handle())) client.read();
        });
        const auto before = handshakes->counters().handshakes;
        begin(std::move(sockets.server));
        run_until(ended() + 1);
        for (Stream& stream : streams) stream.close();
        thread.join();
        for (std::size_t i = 0; i < kOutcomeWords.size(); ++i)
            if (handshakes->counters().handshakes[i] > before[i]) return static_cast<Outcome>(i);
        return Outcome::broken;
    }

    TestPlant plant;
    asio::io_context io{1};
    std::shared_ptr<Handshakes> handshakes;
    std::list<Stream> streams;
};

TEST_F(HandshakesTest, KnowsWhoIsThereByTheCertificate) {
    serve(plant.settings(ClientCertificate::required));
    const Issued panel = issue_client(plant.ca, "panel PC", "operator", valid());
    EXPECT_EQ(outcome_for(panel), Outcome::done);
    EXPECT_EQ(streams.back().peer().subject, "CN=panel PC");
    EXPECT_EQ(streams.back().peer().role, "operator");
    EXPECT_TRUE(streams.back().peer().role_fault.empty());
}

TEST_F(HandshakesTest, NeedsNoCertificateWhereNoneIsAskedFor) {
    serve(plant.settings());
    EXPECT_EQ(outcome_for({}), Outcome::done);
    EXPECT_EQ(streams.back().peer().subject, "");
    EXPECT_EQ(streams.back().peer().role, std::nullopt);
}

TEST_F(HandshakesTest, RefusesWhoHasNone) {
    serve(plant.settings(ClientCertificate::required));
    EXPECT_EQ(outcome_for({}), Outcome::no_certificate);
}

TEST_F(HandshakesTest, TakesACertificateOrNoneWhereItIsOptional) {
    serve(plant.settings(ClientCertificate::optional));
    EXPECT_EQ(outcome_for({}), Outcome::done);
}

TEST_F(HandshakesTest, RefusesAnExpiredOne) {
    serve(plant.settings(ClientCertificate::required));
    Validity past = valid(1);
    past.now -= 10 * 24 * 3600;
    EXPECT_EQ(outcome_for(issue_client(plant.ca, "old", "operator", past)), Outcome::expired);
}

TEST_F(HandshakesTest, RefusesOneOfAnotherCa) {
    serve(plant.settings(ClientCertificate::optional));
    const Issued other = issue_ca("Plant CA", valid());
    EXPECT_EQ(outcome_for(issue_client(other, "stranger", "admin", valid())), Outcome::untrusted);
}

TEST_F(HandshakesTest, RefusesAServersCertificateOfAClient) {
    serve(plant.settings(ClientCertificate::required));
    EXPECT_EQ(outcome_for(issue_server(plant.ca, {"other.plant"}, valid())), Outcome::untrusted);
}

TEST_F(HandshakesTest, RefusesARevokedOneAlsoByAnOverdueList) {
    Settings settings = plant.settings(ClientCertificate::required);
    settings.crl = "crl.pem";
    const Issued lost = issue_client(plant.ca, "lost", "operator", valid());
    Validity past = valid(1);
    past.now -= 10 * 24 * 3600;
    settings.material.crl = revoke(plant.ca, "", lost.certificate, past);
    serve(settings);
    EXPECT_EQ(outcome_for(lost), Outcome::revoked);
    EXPECT_EQ(outcome_for(issue_client(plant.ca, "other", "operator", valid())), Outcome::done);
}

TEST_F(HandshakesTest, NamesBytesThatAreNoTls) {
    serve(plant.settings());
    Sockets sockets(io);
    begin(std::move(sockets.server));
    asio::write(sockets.client, asio::buffer(std::string("GET / HTTP/1.1\r\n\r\n")));
    run_until(1);
    EXPECT_EQ(count(*handshakes, Outcome::plain), 1u);
}

TEST_F(HandshakesTest, EndsAHandshakeThatDoesNotGoOn) {
    Settings settings = plant.settings();
    settings.handshake_timeout = 20ms;
    serve(settings);
    Sockets sockets(io);
    begin(std::move(sockets.server));
    asio::write(sockets.client, asio::buffer(std::string("\x16\x03\x01\x02", 4)));
    run_until(1);
    EXPECT_EQ(count(*handshakes, Outcome::timeout), 1u);
}

TEST_F(HandshakesTest, TheOldestOfAnAddressGivesWayBeyondItsLimitAndStopEndsAll) {
    Settings settings = plant.settings();
    settings.max_handshakes_per_address = 2;
    serve(settings);
    std::list<Sockets> sockets;
    for (int i = 0; i < 4; ++i) begin(std::move(sockets.emplace_back(io).server));
    EXPECT_EQ(count(*handshakes, Outcome::displaced), 2u);
    char byte = 0;
    boost::system::error_code end;
    sockets.front().client.read_some(asio::buffer(&byte, 1), end);
    EXPECT_EQ(end, asio::error::eof) << "the oldest";
    handshakes->stop();
    EXPECT_EQ(count(*handshakes, Outcome::displaced), 4u);
}

TEST_F(HandshakesTest, WhoWaitsForTheClientGivesWayBeforeWhoWaitsForItsTurn) {
    Settings settings = plant.settings();
    settings.max_handshakes = 3;
    settings.between_handshakes = 1h;
    serve(settings);
    std::list<Sockets> sockets;
    const auto newcomer = [&](const std::string& first_bytes) -> tcp::socket& {
        Sockets& both = sockets.emplace_back(io);
        asio::write(both.client, asio::buffer(first_bytes));
        begin(std::move(both.server));
        io.restart();
        io.poll();
        return both.client;
    };
    const auto is_closed = [](tcp::socket& client) {
        boost::system::error_code end;
        char byte = 0;
        client.non_blocking(true);
        client.read_some(asio::buffer(&byte, 1), end);
        return end != asio::error::would_block;
    };
    tcp::socket& begun = newcomer("\x16");
    tcp::socket& waiting = newcomer("\x16");
    tcp::socket& silent = newcomer("");
    newcomer("");
    EXPECT_TRUE(is_closed(begun)) << "its turn came, and it says nothing";
    newcomer("");
    EXPECT_TRUE(is_closed(silent));
    EXPECT_FALSE(is_closed(waiting));
}

TEST_F(HandshakesTest, CarriesWhatComesTogetherWithTheHandshakesEnd) {
    serve(plant.settings(ClientCertificate::required));
    Sockets sockets(io);
    TestClient client(issue_client(plant.ca, "panel", "viewer", valid()));
    sockets.client.native_non_blocking(false);
    std::string reply;
    std::thread thread([&] {
        if (!client.connect(sockets.client.native_handle()) || !client.write("ping")) return;
        reply = client.read();
    });
    begin(std::move(sockets.server));
    run_until(1);
    Stream& stream = streams.back();
    std::string text(16, ' ');
    bool answered = false;
    stream.async_read_some(asio::buffer(text), [&](const boost::system::error_code& error,
                                                   std::size_t size) {
        EXPECT_FALSE(error);
        text.resize(size);
        const std::array parts{asio::buffer("po", 2), asio::buffer("ng", 2)};
        asio::async_write(stream, parts, [&](const boost::system::error_code& failed, std::size_t) {
            EXPECT_FALSE(failed);
            answered = true;
        });
    });
    while (!answered) io.run_one();
    EXPECT_EQ(text, "ping");
    thread.join();
    EXPECT_EQ(reply, "pong") << "one record";
}

TEST_F(HandshakesTest, NewFilesAreForConnectionsToCome) {
    serve(plant.settings());
    const std::int64_t before = handshakes->counters().certificate_expiry;
    Settings renewed = plant.settings();
    const Issued longer = issue_server(plant.ca, {"gateway.plant"}, valid(60));
    renewed.material.certificate = longer.certificate;
    handshakes->apply(renewed);  // the key is the former one's
    EXPECT_EQ(handshakes->counters().certificate_expiry, before);
    renewed.material.key = longer.key;
    handshakes->apply(renewed);
    EXPECT_GT(handshakes->counters().certificate_expiry, before);
    EXPECT_EQ(outcome_for({}), Outcome::done);
}

TEST_F(HandshakesTest, WhoIsRevokedOrNowNeedsACertificateMustLeave) {
    const Issued lost = issue_client(plant.ca, "lost", {}, valid());
    Settings settings = plant.settings(ClientCertificate::optional);
    serve(settings);
    outcome_for(issue_client(plant.ca, "scada", {}, valid()));
    outcome_for(lost);
    outcome_for({});
    const auto leaving = [&] {
        std::vector<std::string> all;
        for (const Stream& stream : streams) all.push_back(handshakes->why_leave(stream));
        return all;
    };
    EXPECT_EQ(leaving(), (std::vector<std::string>{"", "", ""}));
    settings.crl = "crl.pem";
    settings.material.crl = revoke(plant.ca, "", lost.certificate, valid());
    settings.client = ClientCertificate::required;
    handshakes->apply(settings);
    EXPECT_EQ(leaving(),
              (std::vector<std::string>{"", "the client's certificate CN=lost is revoked",
                                        "the client has shown no certificate, and now must"}));
}

}  // namespace
}  // namespace panelgate::tls::handshakes_test
