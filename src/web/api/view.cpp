#include "view.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "body.hpp"
#include "panelgate/points/value.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/web/http/query.hpp"
#include "point_json.hpp"

namespace panelgate::web {
namespace json = boost::json;
namespace {

std::optional<std::string> query(const HttpRequest& request, const char* name) {
    const auto given = request.query.find(name);
    if (given == request.query.end()) return std::nullopt;
    return given->second;
}

/// The one of all that has this label; otherwise 400 with the labels of all.
template <class Word, std::size_t N>
Parsed<Word> word_of(const char* what, const std::string& text, const Word (&all)[N]) {
    std::string known;
    for (const Word word : all) {
        if (text == label(word)) return word;
        known += (known.empty() ? "" : ", ") + std::string(label(word));
    }
    return problem(
        400, "there is no " + std::string(what) + " '" + excerpt(text) + "'; there are " + known);
}

Parsed<points::Type> type_of(const Wording& wording, bool bits) {
    if (!wording.type) return bits ? points::Type::boolean : points::Type::u16;
    const auto type = word_of("type", *wording.type, points::kTypes);
    if (type && bits && *type != points::Type::boolean)
        return problem(400, "the type of a bit is bool, not " + *wording.type);
    return type;
}

Parsed<unsigned> count_member(const json::object& entry, std::string_view name, unsigned most) {
    if (!entry.contains(name)) return 1u;
    const auto number = number_member(entry, name, 1, most);
    if (!number) return number.error();
    return static_cast<unsigned>(*number);
}

Parsed<std::optional<std::string>> text_member(const json::object& entry, std::string_view name) {
    if (!entry.contains(name)) return std::optional<std::string>();
    auto text = string_member(entry, name);
    if (!text) return text.error();
    return std::optional<std::string>(std::move(*text));
}

}  // namespace

Parsed<Wording> wording_of(const HttpRequest& request) {
    Wording wording;
    wording.type = query(request, "type");
    wording.order = query(request, "order");
    if (query(request, "length")) {
        const auto length = query_number(request, "length", 1, kMaxText, 1);
        if (!length) return length.error();
        wording.length = *length;
    }
    const auto raw = query_flag(request, "raw");
    if (!raw) return raw.error();
    wording.raw = *raw;
    return wording;
}

Parsed<Wording> wording_of(const json::object& entry) {
    Wording wording;
    auto type = text_member(entry, "type");
    if (!type) return type.error();
    wording.type = std::move(*type);
    auto order = text_member(entry, "order");
    if (!order) return order.error();
    wording.order = std::move(*order);
    const auto length = count_member(entry, "length", kMaxText);
    if (!length) return length.error();
    if (entry.contains("length")) wording.length = *length;
    const auto count = count_member(entry, "count", modbus::kTableItems);
    if (!count) return count.error();
    wording.count = *count;
    const auto raw = flag_member(entry, "raw");
    if (!raw) return raw.error();
    wording.raw = *raw;
    return wording;
}

Parsed<View> view_of(const Wording& wording, modbus::Table table) {
    View view;
    const bool bits = modbus::is_bit_table(table);
    view.raw = wording.raw;
    view.value.table = table;
    const auto type = type_of(wording, bits);
    if (!type) return type.error();
    view.value.type = *type;
    if (wording.order) {
        if (bits) return problem(400, "a bit has no order");
        const auto order = word_of("order", *wording.order, points::kOrders);
        if (!order) return order.error();
        view.value.word_order = *order;
    }
    const bool text = *type == points::Type::string;
    if (wording.length && !text) return problem(400, "only a string has a length");
    if (text && !wording.length) {
        // One text of all registers.
        view.value.length = 2 * wording.count;
        view.items = wording.count;
        return view;
    }
    view.value.length = wording.length.value_or(0);
    view.items = wording.count * view.value.count();
    return view;
}

json::array values_of(const View& view, std::span<const std::uint16_t> items) {
    json::array values;
    const std::size_t step = view.value.count();
    for (std::size_t at = 0; at + step <= items.size(); at += step) {
        const auto value = points::decode(view.value, items.subspan(at, step));
        values.push_back(value ? json_of(*value) : json::value(nullptr));
    }
    return values;
}

}  // namespace panelgate::web
