#include "json_reader.hpp"

#include <algorithm>
#include <boost/json/basic_parser_impl.hpp>
#include <boost/json/value_stack.hpp>
#include <boost/system/errc.hpp>
#include <boost/system/error_code.hpp>
#include <charconv>
#include <cstdint>
#include <system_error>
#include <utility>

#include "json_handler.hpp"
#include "panelgate/base/decimal.hpp"
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
