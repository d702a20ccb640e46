#include "repeated_member.hpp"

#include <algorithm>
#include <boost/json/basic_parser_impl.hpp>
#include <boost/system/errc.hpp>
#include <boost/system/error_code.hpp>
#include <set>
#include <utility>
#include <vector>

#include "json_handler.hpp"

namespace panelgate::web {
namespace {

using boost::system::error_code;

/// Sees the names of each open object. As many as the text has; the parser limits the depth.
class Names : public JsonHandler {
  public:
    bool on_object_begin(error_code&) {
        open_.emplace_back();
        return true;
    }
    bool on_object_end(std::size_t, error_code&) {
        open_.pop_back();
        return true;
    }
    bool on_key_part(View part, std::size_t, error_code&) {
        name_ += part;
        return true;
    }
    bool on_key(View part, std::size_t, error_code& error) {
        name_ += part;
        const auto [place, is_new] = open_.back().insert(std::exchange(name_, {}));
        if (is_new) return true;
        repeated = *place;
        error = boost::system::errc::make_error_code(boost::system::errc::invalid_argument);
        return false;
    }

    /// The name that ended the parsing.
    std::optional<std::string> repeated;

  private:
    std::vector<std::set<std::string>> open_;
    std::string name_;
};

}  // namespace

std::optional<RepeatedMember> find_repeated_member(std::string_view json) {
    boost::json::basic_parser<Names> parser{boost::json::parse_options()};
    error_code error;
    const std::size_t used = parser.write_some(false, json.data(), json.size(), error);
    auto& name = parser.handler().repeated;
    if (!name) return std::nullopt;
    // With escapes the name is longer in the text: then its end has to do.
    const std::string quoted = '"' + *name;
    const std::size_t begin = used - std::min(used, quoted.size());
    const bool plain = json.substr(begin, quoted.size()) == quoted;
    return RepeatedMember{std::move(*name), plain ? begin : used};
}

}  // namespace panelgate::web
