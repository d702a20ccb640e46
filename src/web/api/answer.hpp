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

/// A bus that gave no reply (502 line down or damaged, 503 busy, 504 no reply in time).
Problem problem_of(Fault fault, bool transmitted);
/// A panel's exception reply, with its manual's word: 422 for codes 1-4, 502 above.
Problem problem_of_exception(std::uint8_t code, const profile::PanelProfile& profile);
/// Of an answer without a reply of a panel: refused here, or a fault.
Problem problem_of(const bus::Answer& answer);
/// What is wrong with an answer: that, or an exception. Nothing when it carries what was asked.
std::optional<Problem> problem_of(const bus::Answer& answer, const profile::PanelProfile& profile);

/// What a client is told of its broadcast: 202, because nobody answers one.
HttpResponse broadcast_answer(const bus::Answer& answer);

/// For members that end in _ms: rounded towards zero.
std::int64_t whole_ms(Duration duration);
/// "1F 01 FF"
std::string upper_hex(ByteView bytes, std::string_view separator = " ");

/// Does whoever sent this Accept take `type` rather than JSON? (RFC 9110 12.5.1; "" is no.)
bool prefers(std::string_view accept, std::string_view type);

/// Does whoever sent this Accept take text/csv rather than JSON? (RFC 9110 12.5.1; "" is no.)
bool prefers_csv(std::string_view accept);

/// One record (RFC 4180) of these fields.
std::string csv_line(std::span<const std::string_view> fields);
/// The same of an object's members: null and what it lacks are empty.
std::string csv_line(const boost::json::object& object, std::span<const std::string_view> columns);
HttpResponse csv_response(std::string body);

/// A body in the content coding gzip, made in pieces: others have their turn in between.
boost::asio::awaitable<std::string> packed(std::string body);

/// The text of a JSON object that is too long to be made at once: lists of many, and members. It is
/// made in pieces, and whoever makes it lets others have their turn when is_turn_over().
class LongAnswer {
  public:
    LongAnswer& begin_list(std::string_view name);
    void add(const boost::json::value& entry);
    LongAnswer& end_list();
    LongAnswer& member(std::string_view name, const boost::json::value& value);

    /// True again and again, after each few entries.
    bool is_turn_over();
    HttpResponse response();

  private:
    void begin_member(std::string_view name);

    std::string text_ = "{";
    bool is_first_ = true;  ///< of the object's members, or of the list's entries
    std::size_t entries_ = 0;
};

/// Others have their turn. What a caller that has left meanwhile was asking for may be gone.
boost::asio::awaitable<void> others_turn();

/// A list whose entries are flat objects. What `entry` looks at outlives the request, or `entry`
/// holds it.
struct Table {
    boost::json::object members;                ///< of JSON, in front of the list
    std::string_view name;                      ///< of the list
    std::span<const std::string_view> columns;  ///< of text/csv
    std::size_t count = 0;
    std::function<boost::json::object(std::size_t)> entry;  ///< 0 to count - 1
};

/// As JSON, or as text/csv to who prefers that; made in pieces, between which others have their
/// turn.
Handling table_answer(HttpRequest request, Table table);

/// An answer that is long and the same for all until it is made anew: its text, its tag and its
/// gzip are made once, and whoever asks is sent those.
class KeptAnswer {
  public:
    /// `content_type` lives as long as the program.
    KeptAnswer(std::string text, std::string_view content_type);

    /// With its ETag; 304 for who has it; packed for who takes that.
    static boost::asio::awaitable<HttpResponse> give(std::shared_ptr<KeptAnswer> self,
                                                     HttpRequest request);

  private:
    SharedText text_;
    SharedText packed_;  ///< null: nobody has asked for it yet
    std::string tag_;
    std::string_view content_type_;
};

}  // namespace panelgate::web
