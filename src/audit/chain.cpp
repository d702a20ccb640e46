#include "panelgate/audit/chain.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace panelgate::audit {

namespace {

constexpr std::string_view kBegin = "{\"n\":";
constexpr std::string_view kHash = ",\"hash\":\"";
constexpr std::string_view kClose = "\"}";
constexpr std::size_t kSealSize = kHash.size() + 64 + kClose.size();
constexpr std::string_view kPrevious = "\"previous\":\"";

bool is_hex(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }

bool is_kind(std::string_view body, std::string_view kind) {
    constexpr std::string_view kKey = ",\"kind\":\"";
    const auto at = body.find(kKey);
    if (at == body.npos) return false;
    const std::string_view rest = body.substr(at + kKey.size());
    return rest.starts_with(kind) && rest.substr(kind.size()).starts_with('"');
}

}  // namespace

Hash no_hash() {
    Hash hash{};
    hash.fill('0');
    return hash;
}

std::optional<Hash> parse_hash(std::string_view text) {
    Hash hash{};
    if (text.size() != hash.size() || !std::ranges::all_of(text, is_hex)) return std::nullopt;
    std::ranges::copy(text, hash.begin());
    return hash;
}

void Chain::append(std::string& out, std::string_view body) {
    const std::size_t begin = out.size();
    std::array<char, 20> digits{};
    ++last_.number;
    const auto [end, wrong] =
        std::to_chars(digits.data(), digits.data() + digits.size(), last_.number);
    out += kBegin;
    out.append(digits.data(), end);
    out += ',';
    out += body;
    last_.hash = digest_.of(text_of(last_.hash), std::string_view(out).substr(begin));
    out += kHash;
    out += text_of(last_.hash);
    out += kClose;
    out += '\n';
}

std::optional<Sealed> parse_line(std::string_view line) {
    if (!line.starts_with(kBegin) || line.size() < kBegin.size() + kSealSize) return std::nullopt;
    const std::string_view seal = line.substr(line.size() - kSealSize);
    if (!seal.starts_with(kHash) || !seal.ends_with(kClose)) return std::nullopt;
    const auto hash = parse_hash(seal.substr(kHash.size(), 64));
    Sealed record;
    record.text = line.substr(0, line.size() - kSealSize);
    const std::string_view rest = record.text.substr(kBegin.size());
    const auto [end, wrong] =
        std::from_chars(rest.data(), rest.data() + rest.size(), record.number);
    const auto used = static_cast<std::size_t>(end - rest.data());
    const bool is_number = wrong == std::errc{} && record.number > 0 && rest.front() != '0';
    if (!hash || !is_number || used >= rest.size() || rest[used] != ',') return std::nullopt;
    record.body = rest.substr(used + 1);
    record.hash = *hash;
    return record;
}

std::optional<Hash> previous_in(const Sealed& record) {
    if (!is_kind(record.body, "file")) return std::nullopt;
    const auto at = record.body.find(kPrevious);
    if (at == record.body.npos) return std::nullopt;
    return parse_hash(record.body.substr(at + kPrevious.size()).substr(0, 64));
}

Tail parse_tail(std::string_view end) {
    Tail tail;
    const auto newline = end.rfind('\n');
    tail.torn = newline == end.npos ? end : end.substr(newline + 1);
    if (newline == end.npos) return tail;
    const std::string_view whole = end.substr(0, newline);
    const auto before = whole.rfind('\n');
    const auto record = parse_line(before == whole.npos ? whole : whole.substr(before + 1));
    if (!record) {
        tail.continuable = false;
        return tail;
    }
    tail.last = {record->number, record->hash};
    tail.ended = is_kind(record->body, "end");
    return tail;
}

}  // namespace panelgate::audit
