#include "json_reader.hpp"

#include <algorithm>
#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/value_stack.hpp>
#include <boost/system/errc.hpp>
#include <boost/system/error_code.hpp>
#include <charconv>
#include <cstdint>
#include <limits>
#include <system_error>
#include <utility>

#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace {

using boost::system::error_code;
using View = boost::json::string_view;

template <class Number>
std::optional<Number> number_of(const std::string& text) {
    Number number{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return number;
}

/// "1.50e3" as "1500"; nothing for a fraction, for what is longer than any integer, and for 0,
/// whose sign a float keeps.
std::optional<std::string> whole_digits(std::string_view text) {
    constexpr std::int64_t kMost = 20;
    const std::size_t mark = std::min(text.find_first_of("eE"), text.size());
    const std::size_t point = std::min(text.find('.'), mark);
    std::int64_t exponent = 0;
    if (mark < text.size()) {
        std::string power(text.substr(mark + 1));
        if (power.starts_with('+')) power.erase(0, 1);
        const auto given = number_of<std::int64_t>(power);
        if (!given || *given > kMost || *given < -1'000'000) return std::nullopt;
        exponent = *given;
    }
    if (point < mark) exponent -= static_cast<std::int64_t>(mark - point - 1);
    std::string digits(text.substr(0, mark));
    std::erase(digits, '.');
    const bool negative = digits.starts_with('-');
    digits.erase(0, std::min(digits.find_first_not_of("-0"), digits.size()));
    for (; exponent < 0 && digits.ends_with('0'); ++exponent) digits.pop_back();
    const auto length = static_cast<std::int64_t>(digits.size()) + exponent;
    if (digits.empty() || exponent < 0 || length > kMost) return std::nullopt;
    digits.append(static_cast<std::size_t>(exponent), '0');
    return (negative ? "-" : "") + digits;
}

/// Makes the value, as boost::json's own handler does, but for numbers.
class Builder {
  public:
    static constexpr std::size_t max_object_size = std::numeric_limits<std::size_t>::max();
    static constexpr std::size_t max_array_size = max_object_size;
    static constexpr std::size_t max_key_size = max_object_size;
    static constexpr std::size_t max_string_size = max_object_size;

    bool on_document_begin(error_code&) {
        stack_.reset();
        return true;
    }
    bool on_document_end(error_code&) { return true; }
    bool on_object_begin(error_code&) { return true; }
    bool on_object_end(std::size_t count, error_code&) {
        stack_.push_object(count);
        return true;
    }
    bool on_array_begin(error_code&) { return true; }
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
    bool on_comment_part(View, error_code&) { return true; }
    bool on_comment(View, error_code&) { return true; }

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
        const auto digits = whole_digits(text);
        if (const auto i = digits ? number_of<std::int64_t>(*digits) : std::nullopt) {
            stack_.push_int64(*i);
            return true;
        }
        if (const auto u = digits ? number_of<std::uint64_t>(*digits) : std::nullopt) {
            stack_.push_uint64(*u);
            return true;
        }
        const auto number = number_of<double>(text);
        if (!number) return false;
        if (*number == 0 && text.find_first_of(".eE-") == text.npos) {
            stack_.push_int64(0);
        } else {
            stack_.push_double(*number);
        }
        return true;
    }

    boost::json::value_stack stack_;
    std::string number_;
};

std::string why_no_json(std::string_view rest, const error_code& error) {
    for (const char* const word : {"NaN", "Infinity"})
        if (rest.starts_with(word)) return std::string(word) + " is no number of JSON";
    return error.message();
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
    if (error) return {nullptr, JsonFault{used, why_no_json(text.substr(used), error)}};
    if (used < text.size()) return {nullptr, JsonFault{used, "something follows the value"}};
    return {parser.handler().release(), std::nullopt};
}

}  // namespace panelgate::web
