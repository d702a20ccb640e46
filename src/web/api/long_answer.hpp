#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/value.hpp>
#include <cstddef>
#include <string>
#include <string_view>

#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

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

}  // namespace panelgate::web
