#pragma once

#include <boost/json/value.hpp>
#include <cstdint>
#include <optional>
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

}  // namespace panelgate::web
