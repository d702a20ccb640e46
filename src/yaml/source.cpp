#include "source.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "encoding.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

/// Characters that may end a plain value, and the bytes that mask them: F5 and above begin no
/// character (RFC 3629, 3).
constexpr std::string_view kMeaning = "{}[],:# ";
constexpr std::string_view kMasks = "\xF5\xF6\xF7\xF8\xF9\xFA\xFB\xFC";
static_assert(kMeaning.size() == kMasks.size());

void exchange(char& c, std::string_view from, std::string_view to) {
    const std::size_t at = from.find(c);
    if (at != std::string_view::npos) c = to[at];
}

}  // namespace

std::string mask_variables(std::string_view text) {
    std::string masked(text);
    std::size_t at = masked.find("${");
    while (at != std::string::npos) {
        // After a quote or a line end the brace belongs to something else.
        const std::size_t end = masked.find_first_of("}\"'\r\n", at);
        if (end == std::string::npos) break;
        if (masked[end] == '}') {
            for (std::size_t i = at + 1; i <= end; ++i) exchange(masked[i], kMeaning, kMasks);
        }
        at = masked.find("${", end);  // any `${` before it has the same end
    }
    return masked;
}

std::string unmask_variables(std::string text) {
    std::ranges::for_each(text, [](char& c) { exchange(c, kMasks, kMeaning); });
    return text;
}

namespace {

constexpr std::size_t kStride = 64;

bool is_inside(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

std::size_t count_inside(std::string_view text) {
    return static_cast<std::size_t>(std::ranges::count_if(text, is_inside));
}

/// True if it takes two columns of a terminal (Unicode, UAX 11).
bool is_wide(char32_t c) {
    return (c >= 0x1100 && c < 0x1160) || (c >= 0x2E80 && c < 0xA4D0) ||
           (c >= 0xAC00 && c < 0xD7A4) || (c >= 0xF900 && c < 0xFB00) ||
           (c >= 0xFF01 && c < 0xFF61) || (c >= 0x20000 && c < 0x40000);
}

/// Returns blanks of the width of what precedes the caret.
std::string blanks_for(std::string_view before) {
    std::string blanks;
    for (std::size_t at = 0; at < before.size();) {
        const std::string_view character = character_at(before, at);
        blanks += character == "\t" ? "\t" : is_wide(code_point(character)) ? "  " : " ";
        at += character.size();
    }
    return blanks;
}

std::size_t offset_of_column(std::string_view line, int column) {
    std::size_t at = 0;
    for (int c = 1; c < column && at < line.size(); ++c) at += character_at(line, at).size();
    return at;
}

}  // namespace

Source::Source(std::string all) : text_(std::move(all)), lines_{0} {
    for (std::size_t at = text_.find('\n'); at != std::string::npos; at = text_.find('\n', at + 1))
        lines_.push_back(at + 1);
    std::size_t inside = 0;
    for (std::size_t at = 0; at < text_.size(); at += kStride) {
        inside_.push_back(inside);
        inside += count_inside(text().substr(at, kStride));
    }
    inside_.push_back(inside);
}

std::size_t Source::characters(std::size_t from, std::size_t to) const {
    if (inside_.back() == 0) return to - from;  // ASCII alone
    const auto inside_before = [this](std::size_t at) {
        const std::size_t stride = at / kStride;
        return inside_[stride] + count_inside(text().substr(stride * kStride, at % kStride));
    };
    return to - from - (inside_before(to) - inside_before(from));
}

Mark Source::mark(std::size_t offset) const {
    const std::size_t at = std::min(offset, text_.size());
    const auto next = std::upper_bound(lines_.begin(), lines_.end(), at);
    return {static_cast<int>(next - lines_.begin()),
            static_cast<int>(characters(*std::prev(next), at)) + 1};
}

Mark Source::mark(int line, int column) const {
    if (line < 0 || static_cast<std::size_t>(line) >= lines_.size()) return mark(text_.size());
    const std::size_t begin = lines_[static_cast<std::size_t>(line)];
    const std::size_t at = begin + static_cast<std::size_t>(column);
    if (at > text_.size()) return mark(at);
    return {line + 1, static_cast<int>(characters(begin, at)) + 1};
}

std::size_t Source::end_of(int line) const {
    const auto next = static_cast<std::size_t>(line);
    return next < lines_.size() ? lines_[next] - 1 : text_.size();
}

std::string_view Source::line(int number) const {
    if (number < 1 || static_cast<std::size_t>(number) > lines_.size()) return {};
    const std::size_t from = lines_[static_cast<std::size_t>(number) - 1];
    std::string_view line = text().substr(from, text_.find('\n', from) - from);
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

char Source::byte(int line, int column) const {
    if (line < 0 || static_cast<std::size_t>(line) >= lines_.size()) return '\n';
    const std::size_t at =
        lines_[static_cast<std::size_t>(line)] + static_cast<std::size_t>(column);
    return at < text_.size() ? text_[at] : '\n';
}

std::string Source::excerpt(Mark mark) const {
    constexpr std::size_t kBefore = 70;
    constexpr std::size_t kShown = 100;
    std::string_view shown = line(mark.line);
    std::size_t caret = offset_of_column(shown, mark.column);
    std::size_t cut = caret > kBefore ? caret - kBefore : 0;
    while (cut < caret && is_inside(shown[cut])) ++cut;
    const std::string left = cut > 0 ? "..." : "";
    shown.remove_prefix(cut);
    caret -= cut;
    std::size_t end = std::min(kShown, shown.size());
    while (end < shown.size() && is_inside(shown[end])) ++end;
    const std::string right = end < shown.size() ? "..." : "";
    return "  " + left + std::string(shown.substr(0, end)) + right + "\n  " +
           blanks_for(left + std::string(shown.substr(0, caret))) + "^\n";
}

}  // namespace panelgate::yaml
