#pragma once

#include <boost/json/object.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "answers.hpp"
#include "commands.hpp"
#include "http_door.hpp"
#include "place.hpp"

namespace panelgate::commands {

/// The token in a file; "" if no file is given; nothing, with a message on stderr, if it cannot be
/// read.
std::optional<std::string> token_in(const std::string& file);

/// A gateway's answer.
struct GatewayAnswer {
    unsigned status = 0;  ///< 0: none
    std::string body;
    boost::json::object json;  ///< empty if the body is no object
    std::string failure;       ///< why there is none

    bool is_ok() const { return status >= 200 && status < 300; }
    /// The last part of a problem's type, such as "unknown-notation".
    std::string problem() const;
};

/// Asks a running gateway over REST, a connection a question.
class GatewayClient {
  public:
    /// Finds out where to ask; nothing, with a message on stderr and `code` set, if that is
    /// unknown.
    static std::optional<GatewayClient> make(const GatewayOptions& options, ExitCode& code);

    GatewayAnswer get(const std::string& path, Duration patience = 30s) const;
    GatewayAnswer put(const std::string& path, const std::string& body) const;
    /// Reads the events stream of `path` until `on_event` says true, then returns nothing.
    /// `on_open` is called once it streams, and may ask other questions. Otherwise: the refusal, or
    /// why the stream has ended.
    std::optional<GatewayAnswer> follow(const std::string& path,
                                        const std::function<bool()>& on_open,
                                        const std::function<bool(const Event&)>& on_event) const;

    /// Prints why there is no good answer, behind "panelgate: " and `what`; returns the exit code.
    ExitCode explain(const GatewayAnswer& answer, const std::string& what = {}) const;
    /// Why, as one sentence.
    std::string reason(const GatewayAnswer& answer) const;
    std::string url() const { return door_.url(); }
    /// `text` without the token.
    std::string without_token(std::string text) const;

  private:
    std::string request(const std::string& verb, const std::string& path,
                        const std::string& body) const;
    GatewayAnswer put_question(const std::string& request, Duration patience) const;

    HttpDoor door_;
    std::string token_;
    std::string token_file_;
};

/// A place of a gateway, found by what was typed.
struct GatewayPlace {
    Target target;
    std::string station;  ///< its name, or LINE:ID
    std::string place;
    std::string type;                 ///< of the point
    std::vector<std::string> points;  ///< of the station
};
/// Finds the station and whether the place is one of its points; nothing, with a message on stderr
/// and `code` set, if there is no such station.
std::optional<GatewayPlace> find_place(const GatewayClient& gateway, const Place& typed,
                                       ExitCode& code);
/// Type and order of a point are its configuration's: false, with a message on stderr, if the place
/// is one and they are given.
bool may_have_type(const GatewayPlace& place, bool is_given);
/// Prints why a place could not be read or written; returns the exit code.
ExitCode explain_place(const GatewayClient& gateway, const GatewayPlace& place,
                       const GatewayAnswer& answer, const std::string& verb);
/// Asks for what must be there; false, with a message on stderr and `code` set, if it is not.
bool ask_for(const GatewayClient& gateway, const std::string& path, boost::json::object& into,
             ExitCode& code);
/// All stations; nothing, with a message on stderr and `code` set, if they cannot be had.
std::optional<std::vector<Station>> all_stations(const GatewayClient& gateway, ExitCode& code);
/// From now on SIGINT and SIGTERM end the process with 0, for commands that print until then: each
/// of their lines is written as a whole.
void end_with_signals();

}  // namespace panelgate::commands
