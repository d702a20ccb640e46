#include "json_reader.hpp"

#include <algorithm>
#include <array>
#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/error.hpp>
#include <boost/json/value_stack.hpp>
#include <boost/system/errc.hpp>
#include <boost/system/error_code.hpp>
#include <charconv>
#include <cstdint>
#include <system_error>
#include <utility>

#include "json_handler.hpp"
#include "panelgate/base/decimal.hpp"
#include "panelgate/base/utf8.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace {

using boost::system::error_code;

std::optional<double> double_of(const std::string& text) {
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// Makes the value, as boost::json's own handler does, but for numbers.
class Builder : public JsonHandler {
  public:
    bool on_document_begin(error_code&) {
        stack_.reset();
        return true;
    }
    bool on_object_end(std::size_t count, error_code&) {
        stack_.push_object(count);
        return true;
    }
    bool on_array_end(std::size_t count, error_code&) {
        stack_.push_array(count);
        return true;
    }
    bool on_key_part(View part, std::size_t, error_code&) {
        stack_.push_chars(part);
        return true;
    }
    bool on_key(View part, std::size_t, error_code&) {
        stack_.push_key(part);
        return true;
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
        number_ += part;
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

    boost::json::value release() { return stack_.release(); }

    /// The number that ended the parsing.
    std::optional<std::string> beyond;

  private:
    bool on_number(View part, error_code& error) {
        number_ += part;
        const std::string text = std::exchange(number_, {});
        if (push(text)) return true;
        beyond = text;
        error = boost::system::errc::make_error_code(boost::system::errc::result_out_of_range);
        return false;
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

    boost::json::value_stack stack_;
    std::string number_;
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

struct Slip {
    std::string_view begins;
    std::string_view words;
};
constexpr std::string_view kNoComments = "JSON has no comments; remove it";
constexpr std::array<Slip, 17> kSlips{{
    {"NaN", "NaN is no number of JSON"},
    {"Infinity", "Infinity is no number of JSON"},
    {"\xEF\xBB\xBF", "a byte order mark (U+FEFF) stands before the value; send the body without"},
    {"/", kNoComments},
    {"#", kNoComments},
    {"+", "a number of JSON has no '+'; remove it"},
    {".", "a number of JSON has a digit before its '.'; write 0."},
    {"'", "a text of JSON stands in double quotes"},
    {"True", "it is written true"},
    {"TRUE", "it is written true"},
    {"False", "it is written false"},
    {"FALSE", "it is written false"},
    {"None", "it is written null"},
    {"NULL", "it is written null"},
    {"=", "a ':' follows a name in JSON"},
    {";", "a ',' separates the members of JSON"},
    {",", "a value is missing before this ','"},
}};

/// What was done at `at`, where the parser stopped; "" when nobody knows.
std::string slip_at(std::string_view text, std::size_t at) {
    const std::string_view rest = text.substr(at);
    if (rest.empty()) return "";
    for (const Slip& slip : kSlips)
        if (rest.starts_with(slip.begins)) return std::string(slip.words);
    const char before = at == 0 ? ' ' : text[at - 1];
    if (is_digit(rest[0]) && before == '0')
        return "a number of JSON has no leading zeros; write it without";
    if (static_cast<unsigned char>(rest[0]) < 0x20)
        return "a line end, a tab or another control character inside a text; write \\n, \\t or "
               "\\u00XX";
    const std::size_t last = text.substr(0, at).find_last_not_of(" \t\r\n");
    if ((rest[0] == '}' || rest[0] == ']') && last != text.npos && text[last] == ',')
        return "a ',' too many before this";
    return "";
}

/// Where the first byte is that belongs to no character.
std::size_t end_of_utf8(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t length = utf8_sequence(text.substr(at));
        if (length == 0) return at;
        at += length;
    }
    return text.size();
}

/// The parser stopped at `used`.
JsonFault fault_at(std::string_view text, std::size_t used, const error_code& error) {
    if (text.find_first_not_of(" \t\r\n") == text.npos)
        return {0, "it is empty; send an object, such as {\"value\": 1}"};
    if (!is_utf8(text)) return {end_of_utf8(text), "this is not UTF-8"};
    // Of a number or a word that it had begun, it stops at the end.
    std::string slip = slip_at(text, used);
    if (!slip.empty()) return {used, std::move(slip)};
    if (used >= text.size() || error == boost::json::error::incomplete)
        return {used, "it ends before it is complete; a bracket or a quote is not closed"};
    return {used, error == boost::json::error::syntax
                      ? "a value, a quote, a ':' or a ',' is missing here"
                      : error.message()};
}

}  // namespace

JsonRead read_json(std::string_view text) {
    boost::json::basic_parser<Builder> parser{boost::json::parse_options()};
    error_code error;
    const std::size_t used = parser.write_some(false, text.data(), text.size(), error);
    if (const auto& number = parser.handler().beyond) {
        const std::size_t begin = used - std::min(used, number->size());
        return {nullptr,
                JsonFault{begin, excerpt(*number) + " is beyond what a 64-bit number holds", true}};
    }
    if (error) return {nullptr, fault_at(text, used, error)};
    if (used < text.size()) {
        const bool comment = text[used] == '/' || text[used] == '#';
        return {nullptr, JsonFault{used, comment ? std::string(kNoComments)
                                                 : "something follows the value"}};
    }
    return {parser.handler().release(), std::nullopt};
}

}  // namespace panelgate::web
