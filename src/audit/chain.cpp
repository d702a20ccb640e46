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
bool is_hex(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }

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

std::string_view member_of(std::string_view body, std::string_view key) {
    const std::string sought = '"' + std::string(key) + "\":";
    auto at = body.find(sought);
    while (at != body.npos && at > 0 && body[at - 1] != ',') at = body.find(sought, at + 1);
    if (at == body.npos) return {};
    const std::string_view rest = body.substr(at + sought.size());
    if (rest.starts_with('"')) return rest.substr(1, rest.find('"', 1) - 1);
    return rest.substr(0, rest.find(','));
}

std::optional<Hash> previous_in(const Sealed& record) {
    if (member_of(record.body, "kind") != "file") return std::nullopt;
    return parse_hash(member_of(record.body, "previous"));
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
    tail.ended = member_of(record->body, "kind") == "end";
    return tail;
}

}  // namespace panelgate::audit
