#include "panelgate/audit/chain.hpp"

#include <algorithm>

#include "panelgate/base/text.hpp"

namespace panelgate::audit {

namespace {

constexpr std::string_view kBegin = "{\"n\":";
constexpr std::string_view kHash = ",\"hash\":\"";
constexpr std::string_view kClose = "\"}";
constexpr std::size_t kHashDigits = 64;
constexpr std::size_t kSealSize = kHash.size() + kHashDigits + kClose.size();

}  // namespace

void Chain::append(std::string& out, std::string_view body) {
    const std::size_t begin = out.size();
    ++last_.number;
    out.append(kBegin).append(std::to_string(last_.number)).append(",").append(body);
    last_.hash = text_of(digest_.of(last_.hash, std::string_view(out).substr(begin)));
    out.append(kHash).append(last_.hash).append(kClose).append("\n");
}

std::optional<Sealed> parse_line(std::string_view line) {
    if (line.size() < kBegin.size() + kSealSize || !line.starts_with(kBegin)) return std::nullopt;
    Sealed record;
    record.text = line.substr(0, line.size() - kSealSize);
    const std::string_view seal = line.substr(record.text.size());
    record.hash = seal.substr(kHash.size(), kHashDigits);
    const bool is_sealed = seal.starts_with(kHash) && seal.ends_with(kClose) &&
                           record.hash.find_first_not_of("0123456789abcdef") == line.npos;
    const std::string_view rest = record.text.substr(kBegin.size());
    const std::size_t comma = std::min(rest.find(','), rest.size());
    record.number = to_number<std::uint64_t>(rest.substr(0, comma)).value_or(0);
    const bool is_numbered = record.number > 0 && rest.front() != '0' && comma < rest.size();
    if (!is_sealed || !is_numbered) return std::nullopt;
    record.body = rest.substr(comma + 1);
    return record;
}

bool is_beginning(std::string_view line) {
    const auto size = std::min(line.size(), kBegin.size());
    return line.substr(0, size) == kBegin.substr(0, size);
}

std::string_view member_of(std::string_view body, std::string_view key) {
    const std::string sought = '"' + std::string(key) + "\":";
    auto at = body.find(sought);
    while (at != body.npos && at > 0 && body[at - 1] != ',') at = body.find(sought, at + 1);
    if (at == body.npos) return {};
    const std::string_view rest = body.substr(at + sought.size());
    if (rest.starts_with('"')) return rest.substr(1, rest.find('"', 1) - 1);
    return rest.substr(0, rest.find(','));
}

Tail parse_tail(std::string_view end) {
    Tail tail;
    const auto newline = end.rfind('\n');
    tail.torn = newline == end.npos ? end : end.substr(newline + 1);
    const std::string_view whole = end.substr(0, newline == end.npos ? 0 : newline);
    const auto before = whole.rfind('\n');
    const auto record = parse_line(before == whole.npos ? whole : whole.substr(before + 1));
    if (!record) return tail;
    tail.last = {record->number, std::string(record->hash)};
    tail.ended = member_of(record->body, "kind") == "end";
    return tail;
}

}  // namespace panelgate::audit
