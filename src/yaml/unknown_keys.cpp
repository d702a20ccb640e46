// What MapReader says of keys that nobody has asked for.

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "encoding.hpp"
#include "hints.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

namespace {

/// {id 5, name: press}
bool lacks_colon(const Entry& entry, std::string_view key) {
    return entry.value.kind == Node::Kind::null && entry.key.size() > key.size() + 1 &&
           entry.key.starts_with(std::string(key) + ' ');
}

}  // namespace

bool MapReader::is_mistyped(std::string_view key) const {
    for (std::size_t i = 0; i < node_->entries.size(); ++i) {
        const Entry& entry = node_->entries[i];
        if (entry.key == key || std::ranges::find(known_, entry.key) != known_.end()) continue;
        const Entry* parent = shallow_parent(i);
        if (nearest(entry.key, std::span(&key, 1)) == key || lacks_colon(entry, key) ||
            entry.key.starts_with(std::string(key) + ':') ||
            (parent != nullptr && parent->key == key))
            return true;
    }
    return false;
}

/// Returns the parent of a key that is not indented below it: `serial:` and `baud: 9600` on the
/// next line.
const Entry* MapReader::shallow_parent(std::size_t entry) const {
    const Mark own = node_->entries[entry].mark;
    constexpr std::size_t kFar = 20;  // keys; a file may consist of unknown ones
    const std::size_t end = entry > kFar ? entry - kFar : 0;
    while (entry-- > end) {
        const Entry& above = node_->entries[entry];
        if (above.mark.line >= own.line || above.mark.column != own.column) return nullptr;
        if (std::ranges::find(parents_, above.key) != parents_.end())
            return above.value.kind == Node::Kind::null ? &above : nullptr;
        if (std::ranges::find(known_, above.key) != known_.end()) return nullptr;
    }
    return nullptr;
}

std::string MapReader::is_unknown(std::string_view key) const {
    return "unknown key " + quote(key) + " in " + what_;
}

std::string MapReader::unknown(std::size_t entry) const {
    const std::string& key = node_->entries[entry].key;
    const std::vector<std::string_view> known(known_.begin(), known_.end());
    const std::string message = is_unknown(key);
    const std::string blank = blank_hint(key);
    if (!blank.empty()) return message + blank;
    for (const std::string_view word : known) {
        if (lacks_colon(node_->entries[entry], word))
            return message + "; a ':' is missing: write " + std::string(word) + ": " +
                   key.substr(std::min(key.find_first_not_of("=:> ", word.size()), key.size()));
    }
    if (const Entry* parent = shallow_parent(entry))
        return message + "; below " + quote(parent->key) + " (line " +
               std::to_string(parent->mark.line) +
               ") it must be indented deeper: type 2 blanks before it";
    const Entry& typed = node_->entries[entry];
    if (const std::string place = place_of(typed, true); !place.empty()) return message + place;
    const std::string near = nearest(key, known);
    if (!near.empty()) return message + "; did you mean '" + near + "'?";
    if (const std::string place = place_of(typed, false); !place.empty()) return message + place;
    std::string list;
    for (auto word = known.begin(); word != known.end(); ++word)
        if (std::find(known.begin(), word, *word) == word)  // not asked for before
            list += (list.empty() ? "" : ", ") + std::string(*word);
    return message + "; known keys are " + list;
}

std::string MapReader::place_of(const Entry& entry, bool exactly) const {
    for (const std::span<const Elsewhere> keys : elsewhere_) {
        for (const Elsewhere& place : keys) {
            const bool near = !exactly && nearest(entry.key, std::span(&place.key, 1)) == place.key;
            if (entry.key == place.key || near) return told(place, entry, near);
        }
    }
    return "";
}

std::string MapReader::told(const Elsewhere& place, const Entry& entry, bool near) const {
    const std::string key(place.key);
    const Mark first = node_->entries.front().mark;
    // The first key may be behind a dash; those in { } have no line of their own.
    const bool in_column = &entry != &node_->entries.front() && node_->mark.line == first.line &&
                           node_->mark.column == first.column;
    if (!place.instead.empty()) return "; " + std::string(place.instead);
    if (place.top_column > 0 && !near && in_column)
        return "; it belongs at the top level of the file; take away " +
               std::to_string(entry.mark.column - place.top_column) + " blanks";
    if (place.map.empty())
        return (near ? "; did you mean '" + key + "', a key of " : "; it is a key of ") +
               std::string(place.owner) + (near ? "?" : "");
    const Node& value = entry.value;
    std::string shown = nearest(value.scalar, place.words);
    if (shown.empty())
        shown = value.kind == Node::Kind::scalar ? std::string(clip(value.scalar, 40)) : "...";
    return "; write " + std::string(place.map) + ": {" + key + ": " + shown + '}';
}

bool MapReader::refuse(std::string_view key, const std::string& why) {
    refused_.push_back(key);
    const Node* value = node_->find(key);
    if (value != nullptr) problems_->add(value->mark, std::string(key) + ' ' + why);
    return value != nullptr;
}

void MapReader::finish() {
    for (const auto& [key, instead] : not_empty_)
        if (has(key) && child(key) == nullptr && !is_mistyped(key))
            problem(key, std::string(key) + " has no value; " + instead);
    std::size_t told = 0;
    for (std::size_t i = 0; i < node_->entries.size(); ++i) {
        const Entry& entry = node_->entries[i];
        if (std::ranges::find(refused_, entry.key) != refused_.end()) continue;
        if (std::ranges::find(known_, entry.key) != known_.end()) continue;
        // More hints would not be read, and each takes a while to find.
        problems_->add(entry.mark, ++told > kMaxShown ? is_unknown(entry.key) : unknown(i));
    }
    for (const std::string& key : excused_) {
        if (told == 0) problems_->add(node_->mark, needs(key));  // the similar key was a known one
    }
}

std::string did_you_mean(std::string_view typed, std::span<const std::string_view> known,
                         std::string_view noun) {
    const std::string near = nearest(typed, known);
    if (!near.empty()) return "; did you mean '" + near + "'?";
    if (known.empty()) return "; there are none";
    std::string list;
    constexpr std::size_t kMost = 30;
    for (const std::string_view word : known.first(std::min(kMost, known.size())))
        list += (list.empty() ? "" : ", ") + std::string(word);
    if (known.size() > kMost) list += " and " + std::to_string(known.size() - kMost) + " more";
    return "; known " + std::string(noun) + " are " + list;
}

std::string no_such(std::string_view what, std::string_view typed,
                    std::span<const std::string_view> known) {
    return "there is no " + std::string(what) + ' ' + quote(typed) +
           did_you_mean(typed, known, std::string(what) + 's');
}

}  // namespace panelgate::yaml
