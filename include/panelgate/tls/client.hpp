#pragma once

#include <functional>
#include <string>

#include "panelgate/tls/stream.hpp"

namespace panelgate::tls {

/// Whom a client believes, in PEM form: the server that has this very certificate, whatever its
/// name and dates, or a server whose certificate the CA has signed for its name or address.
struct Trust {
    std::string certificate;
    std::string ca;
    bool any_name = false;  ///< the CA's signature is enough, whatever names it is for
    bool anybody = false;   ///< whoever is there: for a question that holds no secret
};

/// Makes a connected socket secure, from the client's side: for programs that ask one server, by
/// its name or its address. `done` is called once, later: with why it failed, or "" and the stream.
void connect(boost::asio::ip::tcp::socket socket, const Trust& trust, const std::string& server,
             std::function<void(const std::string& why, Stream stream)> done);

}  // namespace panelgate::tls
