#pragma once

#include <functional>
#include <string>

namespace panelgate::tls {

class Stream;

/// Whom a client believes, in PEM form: the server that has this very certificate, whatever its
/// name and dates, or one that the CA has signed for the server's name or address.
struct Trust {
    std::string certificate;
    std::string ca;
    bool any_name = false;  ///< the CA's signature is enough, whatever names it is for
    bool anybody = false;   ///< whoever is there: for a question that holds no secret
};

/// Makes a connected stream secure, from the client's side, in the loop: for programs that ask one
/// server, by its name or its address. `done` is called once with why it failed, "" if it did not.
/// The stream outlives it.
void connect(Stream& stream, const Trust& trust, const std::string& server,
             std::function<void(const std::string& why)> done);

}  // namespace panelgate::tls
