#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "exchange.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/web/api/values.hpp"
#include "panelgate/web/http/message.hpp"
#include "target.hpp"

namespace panelgate::web {

HttpResponse json_response(unsigned status, const boost::json::value& body);
HttpResponse text_response(unsigned status, std::string body,
                           std::string_view content_type = "text/plain; charset=utf-8");

/// As a technician writes the item `behind` the first; "" if the panel is not known.
std::string notation_of(const Target& target, std::size_t behind);
/// {"station","table","address","notation","values",["raw"],"age_ms","source",["transactions"]}
boost::json::object describe(const Target& target, const View& view, const Reading& reading);
/// A point as its items have just been read.
points::PointReading point_reading(const points::Point& point, const Reading& reading);

/// True if this Accept header names text/csv, and JSON not before it. Weights are not read.
bool wants_csv(std::string_view accept);
/// One CSV record (RFC 4180) of these fields.
std::string csv_line(std::span<const std::string_view> fields);
/// The same from an object's members: null and missing ones become empty fields.
std::string csv_line(const boost::json::object& object, std::span<const std::string_view> columns);

/// Builds the text of a large JSON object of lists and members without a tree of all of them.
class LongAnswer {
  public:
    LongAnswer& begin_list(std::string_view name);
    void add(const boost::json::value& entry);
    LongAnswer& end_list();
    LongAnswer& member(std::string_view name, const boost::json::value& value);

    /// The complete text; no calls may follow.
    std::string text();

  private:
    void begin_member(std::string_view name);

    std::string text_ = "{";
    bool is_first_ = true;  ///< of the object's members, or of the list's entries
};

/// A list of objects. The plant's loop copies what changes; the faces' loop calls `entry`.
struct Table {
    /// Keeps what never changes (names, points) for `entry`; null: `entry` needs none.
    std::shared_ptr<const Directory> directory{};
    boost::json::object members{};                ///< JSON members before the list
    std::string_view name;                        ///< of the list
    std::span<const std::string_view> columns{};  ///< of text/csv; none: only JSON
    std::size_t count = 0;
    std::function<boost::json::object(std::size_t)> entry{};  ///< 0 to count - 1
    boost::json::object behind{};                             ///< JSON members behind the list
};
/// Renders the table, in the loop of the faces, as JSON, or as text/csv if the table has columns
/// and the client wants that.
HttpResponse table_answer(const HttpRequest& request, Table table);

/// A long answer that is the same for all clients: text, tag and gzip are made once and then
/// reused.
class KeptAnswer {
  public:
    /// `make` composes the text, once: in the faces' loop, or in its worker if all responses of
    /// this answer are long. `content_type` must have static lifetime.
    KeptAnswer(std::function<std::string()> make, std::string_view content_type)
        : make_(std::move(make)), content_type_(content_type) {}

    /// The answer with its ETag: 304 if the client has it already, gzip if the client accepts it.
    static HttpResponse give(const std::shared_ptr<KeptAnswer>& self, const HttpRequest& request);

  private:
    void give(HttpResponse& response, const std::string& if_none_match, bool takes_gzip);

    std::function<std::string()> make_;  ///< of one thread, as what follows; null: made
    SharedText text_;
    SharedText packed_;  ///< null: not requested yet
    std::string tag_;
    std::string_view content_type_;
};

/// A weak validator (RFC 9110 8.8.1) of a body. It ignores what only time changes: members that end
/// in _ms, and `time`.
std::string tag_of(std::string_view body);
/// Adds the ETag to the response. Returns true and sets status 304 if this If-None-Match names the
/// tag (RFC 9110 13.1.2): the response then has no body.
bool add_etag(HttpResponse& response, std::string_view if_none_match, const std::string& tag);

}  // namespace panelgate::web
