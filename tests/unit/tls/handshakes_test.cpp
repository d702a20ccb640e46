#include "panelgate/tls/handshakes.hpp"

#include <gtest/gtest.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <string>
#include <vector>

#include "tls_rig.hpp"

namespace panelgate::tls::handshakes_test {
namespace {

namespace asio = boost::asio;

std::uint64_t count(const Handshakes& all, Outcome outcome) {
    return all.counters().handshakes[static_cast<std::size_t>(outcome)];
}

class HandshakesTest : public ::testing::Test {
  protected:
    void serve(const Settings& settings) {
        handshakes = std::make_shared<Handshakes>(io.get_executor(), "127.0.0.1:802", settings);
    }
    /// Begins one; the result is in `results` then.
    std::shared_ptr<Stream> begin(asio::ip::tcp::socket socket, const std::string& address = "a") {
        auto stream = std::make_shared<Stream>(std::move(socket));
        handshakes->begin(stream, *stream, "127.0.0.1:1", address,
                          [this](bool secure) { results.push_back(secure); });
        return stream;
    }
    void run_until(std::size_t ended) {
        while (results.size() < ended) {
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
        last = begin(std::move(sockets.server));
        run_until(1);
        last->close();
        thread.join();
        for (std::size_t i = 0; i < kOutcomeWords.size(); ++i)
            if (handshakes->counters().handshakes[i] > 0) return static_cast<Outcome>(i);
        return Outcome::broken;
    }

    TestPlant plant;
    asio::io_context io{1};
    std::shared_ptr<Handshakes> handshakes;
    std::vector<bool> results;
    std::shared_ptr<Stream> last;
};

TEST_F(HandshakesTest, KnowsWhoIsThereByTheCertificate) {
    serve(plant.settings(ClientCertificate::required));
    const Issued panel = issue_client(plant.ca, "panel PC", "operator", valid());
    EXPECT_EQ(outcome_for(panel), Outcome::done);
    EXPECT_EQ(last->peer().subject, "CN=panel PC");
    EXPECT_EQ(last->peer().role, "operator");
    EXPECT_TRUE(last->peer().role_fault.empty());
}

TEST_F(HandshakesTest, NeedsNoCertificateWhereNoneIsAskedFor) {
    serve(plant.settings());
    EXPECT_EQ(outcome_for({}), Outcome::done);
    EXPECT_EQ(last->peer().subject, "");
    EXPECT_EQ(last->peer().role, std::nullopt);
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
    results.clear();
    outcome_for(issue_client(plant.ca, "other", "operator", valid()));
    EXPECT_EQ(count(*handshakes, Outcome::done), 1u);
}

TEST_F(HandshakesTest, NamesBytesThatAreNoTls) {
    serve(plant.settings());
    Sockets sockets(io);
    begin(std::move(sockets.server));
    asio::write(sockets.client, asio::buffer(std::string("GET / HTTP/1.1\r\n\r\n")));
    run_until(1);
    EXPECT_EQ(results, std::vector{false});
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

TEST_F(HandshakesTest, OfAddressesWithEquallyManyTheOldestGivesWay) {
    Settings settings = plant.settings();
    settings.max_handshakes = 3;
    serve(settings);
    std::vector<std::shared_ptr<Stream>> streams;
    std::vector<std::unique_ptr<Sockets>> sockets;
    std::vector<std::string> gone;
    for (const char* address : {"c", "a", "b", "d"}) {
        sockets.push_back(std::make_unique<Sockets>(io));
        streams.push_back(std::make_shared<Stream>(std::move(sockets.back()->server)));
        handshakes->begin(streams.back(), *streams.back(), "127.0.0.1:1", address,
                          [&gone, address](bool) { gone.emplace_back(address); });
    }
    EXPECT_EQ(gone, std::vector<std::string>{"c"});
    for (const auto& stream : streams) stream->close();
    while (gone.size() < 4) io.run_one();
}

TEST_F(HandshakesTest, TheOldestOfAnAddressGivesWayBeyondItsLimit) {
    Settings settings = plant.settings();
    settings.max_handshakes_per_address = 2;
    settings.max_handshakes = 4;
    serve(settings);
    std::vector<std::shared_ptr<Stream>> streams;
    std::vector<std::unique_ptr<Sockets>> sockets;
    for (const char* address : {"a", "a", "a", "b", "b", "c"}) {
        sockets.push_back(std::make_unique<Sockets>(io));
        streams.push_back(begin(std::move(sockets.back()->server), address));
    }
    EXPECT_EQ(count(*handshakes, Outcome::displaced), 2u);
    EXPECT_EQ(results.size(), 2u);
    for (const auto& stream : streams) stream->close();
    run_until(6);
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
    const auto stream = begin(std::move(sockets.server));
    run_until(1);
    std::string text(16, ' ');
    stream->async_read_some(asio::buffer(text),
                            [&](const boost::system::error_code& error, std::size_t size) {
                                EXPECT_FALSE(error);
                                text.resize(size);
                                results.push_back(true);
                            });
    run_until(2);
    EXPECT_EQ(text, "ping");
    boost::system::error_code error;
    EXPECT_EQ(stream->write_some(asio::buffer(std::string("pong")), error), 4u);
    thread.join();
    EXPECT_EQ(reply, "pong");
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

class ReviewTest : public HandshakesTest {
  protected:
    /// A client that was let in.
    struct Guest {
        std::shared_ptr<Stream> stream;
        std::vector<std::string> told{};
    };
    void let_in(Guest& guest, const Issued& identity) {
        Sockets sockets(io);
        TestClient client(identity);
        sockets.client.native_non_blocking(false);
        std::thread thread([&] { client.connect(sockets.client.native_handle()); });
        results.clear();
        guest.stream = begin(std::move(sockets.server));
        run_until(1);
        thread.join();
    }
    /// What the clients are told once `settings` apply.
    bool apply(const Settings& settings, std::initializer_list<Guest*> guests) {
        if (!handshakes->apply(settings)) return false;
        std::vector<Handshakes::Guest> all;
        for (Guest* guest : guests)
            all.push_back({guest->stream, guest->stream.get(),
                           [guest](const std::string& why) { guest->told.push_back(why); }});
        handshakes->review(std::move(all));
        io.restart();
        io.run();
        return true;
    }
};

TEST_F(ReviewTest, WhoWouldNotBeLetInNowIsToldWhyAndNobodyElse) {
    const Issued scada = issue_client(plant.ca, "scada", {}, valid());
    const Issued lost = issue_client(plant.ca, "lost", {}, valid());
    Settings settings = plant.settings(ClientCertificate::optional);
    serve(settings);
    Guest good;
    Guest bad;
    Guest nobody;
    let_in(good, scada);
    let_in(bad, lost);
    let_in(nobody, {});
    settings.crl = "crl.pem";
    settings.material.crl = revoke(plant.ca, "", lost.certificate, valid());
    ASSERT_TRUE(apply(settings, {&good, &bad, &nobody}));
    EXPECT_EQ(bad.told, std::vector<std::string>{"the client's certificate CN=lost is revoked"});
    settings.client = ClientCertificate::required;
    ASSERT_TRUE(apply(settings, {&good, &nobody}));
    EXPECT_EQ(nobody.told,
              std::vector<std::string>{"the client has shown no certificate, and now must"});
    EXPECT_TRUE(good.told.empty());
    settings.material.ca = issue_ca("Another", valid()).certificate;
    settings.crl = settings.material.crl = "";
    ASSERT_TRUE(apply(settings, {&good}));
    EXPECT_EQ(good.told, std::vector<std::string>{
                             "the client's certificate CN=scada is not signed by the CA of `ca`"});
}

TEST_F(ReviewTest, AnotherPairOfTheGatewayIsNoReasonToReview) {
    Settings settings = plant.settings(ClientCertificate::required);
    serve(settings);
    const Issued another = issue_server(plant.ca, {"gateway.plant"}, valid());
    settings.material.certificate = another.certificate;
    settings.material.key = another.key;
    EXPECT_FALSE(handshakes->apply(settings));
}

TEST_F(ReviewTest, AHandshakeThatBeganByFormerRulesIsJudgedByTheNewOnes) {
    const Issued lost = issue_client(plant.ca, "lost", {}, valid());
    Settings settings = plant.settings(ClientCertificate::required);
    serve(settings);
    Sockets sockets(io);
    TestClient client(lost);
    sockets.client.native_non_blocking(false);
    last = begin(std::move(sockets.server));
    settings.crl = "crl.pem";
    settings.material.crl = revoke(plant.ca, "", lost.certificate, valid());
    EXPECT_TRUE(handshakes->apply(settings));
    std::thread thread([&] {
        if (client.connect(sockets.client.native_handle())) client.read();
    });
    run_until(1);
    last->close();
    thread.join();
    EXPECT_EQ(results, std::vector<bool>{false});
    EXPECT_EQ(count(*handshakes, Outcome::revoked), 1U);
}

}  // namespace
}  // namespace panelgate::tls::handshakes_test
