#include "panelgate/web/http/json_text.hpp"

#include <algorithm>
#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/error.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value_stack.hpp>
#include <boost/system/errc.hpp>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "panelgate/base/decimal.hpp"
#include "panelgate/base/text.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

constexpr char kExactNumber = '\xFF';  ///< prefix of the digits; never in UTF-8

void append(std::string& text, const json::value& value);

/// Fast path: most texts need no escape, and a trace has thousands of them.
void append(std::string& text, json::string_view words) {
    const bool plain = std::ranges::none_of(words, [](char c) {
        return static_cast<unsigned char>(c) < 0x20 || c == '"' || c == '\\';
    });
    if (!plain) {
        text += json::serialize(words);
        return;
    }
    text += '"';
    text += words;
    text += '"';
}

void append(std::string& text, const json::array& array) {
    text += '[';
    bool first = true;
    for (const json::value& value : array) {
        if (!first) text += ',';
        first = false;
        append(text, value);
    }
    text += ']';
}

void append(std::string& text, const json::object& object) {
    text += '{';
    bool first = true;
    for (const auto& [name, value] : object) {
        if (!first) text += ',';
        first = false;
        append(text, name);
        text += ':';
        append(text, value);
    }
    text += '}';
}

/// Recursion is bounded: parsed values have a depth limit, those made here are flat.
void append(std::string& text, const json::value& value) {
    if (const json::array* array = value.if_array()) return append(text, *array);
    if (const json::object* object = value.if_object()) return append(text, *object);
    if (const auto digits = exact_digits(value)) {
        text += *digits;
        return;
    }
    if (const json::string* words = value.if_string())
        return append(text, json::string_view(*words));
    const double* number = value.if_double();
    if (number == nullptr) {
        text += json::serialize(value);
        return;
    }
    const std::string digits = number_text(*number);
    text += digits.empty() ? "null" : digits;
}

}  // namespace

std::string json_text(const json::value& value) {
    std::string text;
    append(text, value);
    return text;
}

namespace {

using boost::system::error_code;

std::optional<double> double_of(const std::string& text) {
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// A handler of boost::json::basic_parser that builds the value as the library's own handler does,
/// except for numbers, and refuses members that come twice.
class Builder {
  public:
    using View = json::string_view;
    static constexpr std::size_t max_object_size = std::numeric_limits<std::size_t>::max();
    static constexpr std::size_t max_array_size = max_object_size;
    static constexpr std::size_t max_key_size = max_object_size;
    static constexpr std::size_t max_string_size = max_object_size;

    bool on_document_begin(error_code&) {
        stack_.reset();
        return true;
    }
    bool on_document_end(error_code&) { return true; }
    bool on_object_begin(error_code&) {
        names_.emplace_back();
        return true;
    }
    bool on_object_end(std::size_t count, error_code&) {
        names_.pop_back();
        stack_.push_object(count);
        return true;
    }
    bool on_array_begin(error_code&) { return true; }
    bool on_array_end(std::size_t count, error_code&) {
        stack_.push_array(count);
        return true;
    }
    bool on_key_part(View part, std::size_t, error_code&) {
        word_ += part;
        stack_.push_chars(part);
        return true;
    }
    bool on_key(View part, std::size_t, error_code& error) {
        stack_.push_key(part);
        const std::string name = std::exchange(word_, {}) + std::string(part);
        if (names_.back().insert(name).second) return true;
        return stop("the member '" + excerpt(name) + "' comes a second time: ", "", '"' + name,
                    error);
    }
    bool on_string_part(View part, std::size_t, error_code&) {
        stack_.push_chars(part);
        return true;
    }
    bool on_string(View part, std::size_t, error_code&) {
        stack_.push_string(part);
        return true;
    }
    bool on_number_part(View part, error_code&) {
        word_ += part;
        return true;
    }
    bool on_int64(std::int64_t, View part, error_code& error) { return on_number(part, error); }
    bool on_uint64(std::uint64_t, View part, error_code& error) { return on_number(part, error); }
    bool on_double(double, View part, error_code& error) { return on_number(part, error); }
    bool on_bool(bool value, error_code&) {
        stack_.push_bool(value);
        return true;
    }
    bool on_null(error_code&) {
        stack_.push_null();
        return true;
    }
    bool on_comment_part(View, error_code&) { return true; }
    bool on_comment(View, error_code&) { return true; }

    json::value release() { return stack_.release(); }

    /// Why the handler has ended the parsing, before and behind the place; empty: it has not.
    std::string before, behind;
    std::string stopped_at;  ///< the text that has ended the parsing

  private:
    bool stop(std::string before_place, std::string behind_place, std::string at,
              error_code& error) {
        before = std::move(before_place);
        behind = std::move(behind_place);
        stopped_at = std::move(at);
        error = boost::system::errc::make_error_code(boost::system::errc::invalid_argument);
        return false;
    }
    bool on_number(View part, error_code& error) {
        const std::string text = std::exchange(word_, {}) + std::string(part);
        if (push(text)) return true;
        return stop("a number that cannot be: ",
                    ": " + excerpt(text) + " is beyond what a 64-bit number holds", text, error);
    }
    bool push(const std::string& text) {
        const auto number = double_of(text);
        const auto exact = Decimal::parse(text);
        if (!number || !exact) return false;
        const bool is_negative_zero = *number == 0 && text.starts_with('-');
        if (const auto i = exact->as_int64(); i && !is_negative_zero) {
            stack_.push_int64(*i);
        } else if (const auto u = exact->as_uint64(); u && !is_negative_zero) {
            stack_.push_uint64(*u);
        } else if (Decimal(*number) == *exact) {
            stack_.push_double(*number);
        } else {
            stack_.push_string(exact_number(exact->text()).get_string());
        }
        return true;
    }

    json::value_stack stack_;
    std::vector<std::set<std::string>> names_;  ///< of each object that is open
    std::string word_;                          ///< the parts so far of a name or a number
};

/// "line 2, column 5"
std::string place_of(std::string_view text, std::size_t at) {
    const std::string_view before = text.substr(0, std::min(at, text.size()));
    const auto line = 1 + std::ranges::count(before, '\n');
    const auto line_start = before.rfind('\n');
    const auto column = before.size() - (line_start == before.npos ? 0 : line_start + 1) + 1;
    return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

const char* fault_of(std::string_view text, std::size_t used, const error_code& error) {
    if (text.find_first_not_of(" \t\r\n") == text.npos)
        return "it is empty; send an object, such as {\"value\": 1}";
    if (!is_utf8(text)) return "it is not UTF-8";
    if (!error) return "something follows the value";
    if (used >= text.size() || error == json::error::incomplete)
        return "it ends before it is complete; a bracket or a quote is not closed";
    return "a value, a quote, a ':' or a ',' is missing here, or something else is too many";
}

}  // namespace

Parsed<json::value> parse_json(std::string_view text) {
    json::basic_parser<Builder> parser{json::parse_options()};
    error_code error;
    const std::size_t used = parser.write_some(false, text.data(), text.size(), error);
    Builder& built = parser.handler();
    if (!built.before.empty()) {
        const std::size_t begin = used - std::min(used, built.stopped_at.size());
        return problem(400, built.before + place_of(text, begin) + built.behind);
    }
    if (!error && used == text.size()) return built.release();
    return problem(
        400, "the body is not JSON: " + place_of(text, used) + ": " + fault_of(text, used, error));
}

json::value exact_number(std::string_view digits) {
    return json::value(kExactNumber + std::string(digits));
}

std::optional<std::string_view> exact_digits(const json::value& value) {
    const json::string* words = value.if_string();
    if (words == nullptr || words->empty() || words->front() != kExactNumber) return std::nullopt;
    return std::string_view(*words).substr(1);
}

std::string member_text(const json::object& object, std::string_view name) {
    const json::value* const found = object.if_contains(name);
    return found != nullptr && found->is_string() ? std::string(found->get_string()) : "";
}

std::string excerpt(std::string text) {
    constexpr std::size_t kMost = 80;
    if (text.size() <= kMost) return text;
    std::size_t end = kMost;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    return text.substr(0, end) + "...";
}

}  // namespace panelgate::web
