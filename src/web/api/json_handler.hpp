#pragma once

#include <boost/json/string_view.hpp>
#include <boost/system/error_code.hpp>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace panelgate::web {

/// What boost::json::basic_parser asks of a handler, of any size and without an effect: for those
/// that want to see some of it, which hide the members of that name.
struct JsonHandler {
    using error_code = boost::system::error_code;
    using View = boost::json::string_view;

    static constexpr std::size_t max_object_size = std::numeric_limits<std::size_t>::max();
    static constexpr std::size_t max_array_size = max_object_size;
    static constexpr std::size_t max_key_size = max_object_size;
    static constexpr std::size_t max_string_size = max_object_size;

    bool on_document_begin(error_code&) { return true; }
    bool on_document_end(error_code&) { return true; }
    bool on_object_begin(error_code&) { return true; }
    bool on_object_end(std::size_t, error_code&) { return true; }
    bool on_array_begin(error_code&) { return true; }
    bool on_array_end(std::size_t, error_code&) { return true; }
    bool on_key_part(View, std::size_t, error_code&) { return true; }
    bool on_key(View, std::size_t, error_code&) { return true; }
    bool on_string_part(View, std::size_t, error_code&) { return true; }
    bool on_string(View, std::size_t, error_code&) { return true; }
    bool on_number_part(View, error_code&) { return true; }
    bool on_int64(std::int64_t, View, error_code&) { return true; }
    bool on_uint64(std::uint64_t, View, error_code&) { return true; }
    bool on_double(double, View, error_code&) { return true; }
    bool on_bool(bool, error_code&) { return true; }
    bool on_null(error_code&) { return true; }
    bool on_comment_part(View, error_code&) { return true; }
    bool on_comment(View, error_code&) { return true; }
};

}  // namespace panelgate::web
