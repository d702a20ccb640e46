#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

HttpResponse json_response(unsigned status, const boost::json::value& body);

/// The problem for a bus request without a reply (502 line down or damaged, 503 busy, 504 no reply
/// in time).
Problem problem_of(Fault fault, bool transmitted);
/// The problem for a panel's exception reply, with its manual's meaning: 422 for codes 1-4, 502
/// above.
Problem problem_of_exception(std::uint8_t code, const profile::PanelProfile& profile);
/// The problem for an answer without a reply from a panel: refused by the gateway, or a fault.
Problem problem_of(const bus::Answer& answer);
/// The problem for an answer: as above, or an exception reply. Nothing if it carries the requested
/// data.
std::optional<Problem> problem_of(const bus::Answer& answer, const profile::PanelProfile& profile);

/// The answer to a broadcast: 202, because no station replies to one.
HttpResponse broadcast_answer(const bus::Answer& answer);

/// The duration in whole milliseconds, rounded towards zero, for members that end in _ms.
std::int64_t whole_ms(Duration duration);
/// "1F 01 FF"
std::string upper_hex(ByteView bytes, std::string_view separator = " ");

/// True if this Accept header prefers `type` to JSON (RFC 9110 12.5.1; false for "").
bool prefers(std::string_view accept, std::string_view type);

/// True if this Accept header prefers text/csv to JSON (RFC 9110 12.5.1; false for "").
bool prefers_csv(std::string_view accept);

/// One CSV record (RFC 4180) of these fields.
std::string csv_line(std::span<const std::string_view> fields);
/// The same from an object's members: null and missing ones become empty fields.
std::string csv_line(const boost::json::object& object, std::span<const std::string_view> columns);
HttpResponse csv_response(std::string body);

/// Packs a body with gzip, in pieces that yield to the loop.
boost::asio::awaitable<std::string> packed(std::string body);

/// Builds the text of a large JSON object of lists and members in pieces: its caller yields to the
/// loop whenever is_turn_over().
class LongAnswer {
  public:
    LongAnswer& begin_list(std::string_view name);
    void add(const boost::json::value& entry);
    LongAnswer& end_list();
    LongAnswer& member(std::string_view name, const boost::json::value& value);

    /// True after every few entries.
    bool is_turn_over();
    HttpResponse response();

  private:
    void begin_member(std::string_view name);

    std::string text_ = "{";
    bool is_first_ = true;  ///< of the object's members, or of the list's entries
    std::size_t entries_ = 0;
};

/// Yields to the loop. If the caller leaves meanwhile, what its request refers to may be gone.
boost::asio::awaitable<void> yield_turn();

/// A list of flat objects. What `entry` refers to outlives the request, or `entry` owns it.
struct Table {
    boost::json::object members;                ///< JSON members before the list
    std::string_view name;                      ///< of the list
    std::span<const std::string_view> columns;  ///< of text/csv
    std::size_t count = 0;
    std::function<boost::json::object(std::size_t)> entry;  ///< 0 to count - 1
};

/// Renders the table as JSON, or as text/csv if the client prefers that, in pieces that yield to
/// the loop.
Handling table_answer(HttpRequest request, Table table);

/// A long answer that is the same for all clients: text, tag and gzip are made once and then
/// reused.
class KeptAnswer {
  public:
    /// `content_type` must have static lifetime.
    KeptAnswer(std::string text, std::string_view content_type);

    /// The answer with its ETag: 304 if the client has it already, gzip if the client accepts it.
    static boost::asio::awaitable<HttpResponse> give(std::shared_ptr<KeptAnswer> self,
                                                     HttpRequest request);

  private:
    SharedText text_;
    SharedText packed_;  ///< null: not requested yet
    std::string tag_;
    std::string_view content_type_;
};

}  // namespace panelgate::web
