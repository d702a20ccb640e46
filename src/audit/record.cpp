#include "panelgate/audit/record.hpp"

#include <boost/json/serialize.hpp>

#include "panelgate/base/text.hpp"

namespace panelgate::audit {

std::string time_text(WallTime time) {
    constexpr std::size_t kToMilliseconds = 23;
    return rfc3339(time).substr(0, kToMilliseconds) + 'Z';
}

Members record_of(std::string_view kind, WallTime time) {
    return {{"time", time_text(time)}, {"kind", kind}};
}

void add_text(Members& record, std::string_view key, std::string_view value) {
    if (!value.empty()) record[key] = as_utf8(value);
}

void add(Members& record, const Members& more) {
    for (const auto& [key, value] : more) record[key] = value;
}

std::string body_of(const Members& record) {
    const std::string text = boost::json::serialize(record);
    return text.substr(1, text.size() - 2);
}

}  // namespace panelgate::audit
