#include "templates.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::Entry;
using yaml::Node;

std::optional<Node> take(Node& map, std::string_view key) {
    const auto found = std::ranges::find(map.entries, key, &Entry::key);
    if (found == map.entries.end()) return std::nullopt;
    Node value = std::move(found->value);
    map.entries.erase(found);
    return value;
}

/// Adds the keys that `map` does not have.
void add_missing(Node& map, const Node& from) {
    for (const Entry& entry : from.entries) {
        Node* own = map.find(entry.key);
        if (own == nullptr) {
            map.entries.push_back(entry);
        } else if (own->kind == Node::Kind::map && entry.value.kind == Node::Kind::map) {
            add_missing(*own, entry.value);
        }
    }
}

/// Repetitions by an alias keep the places of their keys.
using FilePlace = std::pair<int, int>;
FilePlace place_of(const Entry& entry) { return {entry.mark.line, entry.mark.column}; }

/// `lines` may be null.
template <class Do>
void for_stations(Node* lines, const Do& todo) {
    if (lines == nullptr) return;
    for (Node& line : lines->items) {
        Node* stations = line.find("stations");
        if (stations == nullptr) continue;
        for (Node& station : stations->items) todo(station);
    }
}

struct Template {
    yaml::Mark mark;
    Node body;
    yaml::Size size;
    bool used = false;
};

class Templates {
  public:
    explicit Templates(Loading& loading) : loading_(loading) {}

    void read(Node& list) {
        if (list.kind != Node::Kind::map && list.kind != Node::Kind::null) {
            loading_.problems.add(list.mark,
                                  "templates must be a map of stations by name, such as "
                                  "templates: {meter: {profile: generic}}");
        }
        move_bodies(list);
        for (Entry& entry : list.entries) read_one(entry);
    }

    void apply(Node& station) {
        const auto named = take(station, "template");
        if (!named) return;
        if (named->kind != Node::Kind::scalar) {
            loading_.problems.add(named->mark, "template must be the name of one of 'templates'");
            return;
        }
        const auto found = templates_.find(named->scalar);
        if (found == templates_.end()) {
            loading_.problems.add(named->mark, unknown(named->scalar));
            return;
        }
        found->second.used = true;
        const bool had_room = has_room();
        given_.nodes += found->second.size.nodes;
        given_.text += found->second.size.text;
        if (has_room()) {
            add_missing(station, found->second.body);
        } else if (had_room) {
            loading_.problems.add(named->mark,
                                  "templates give more than " + std::to_string(kMaxTemplateValues) +
                                      " values, or " + std::to_string(kMaxTemplateText >> 20U) +
                                      " MiB of text, to all stations together");
        }
    }

    /// A merge key in `lines` may have used part of them.
    std::vector<Node> take_unused(Node* lines) {
        std::set<FilePlace> taken;
        for_stations(lines, [&](const Node& station) {
            for (const Entry& entry : station.entries) taken.insert(place_of(entry));
        });
        std::vector<Node> unused;
        for (auto& [name, one] : templates_) {
            const bool merged = std::ranges::any_of(one.body.entries, [&](const Entry& entry) {
                return taken.contains(place_of(entry));
            });
            if (one.used || merged) continue;
            loading_.warn(one.mark, "no station has template: " + name);
            if (one.body.kind == Node::Kind::map) unused.push_back(std::move(one.body));
        }
        return unused;
    }

  private:
    bool has_room() const {
        return given_.nodes <= kMaxTemplateValues && given_.text <= kMaxTemplateText;
    }
    /// Reports a station's keys that follow a name without a body, and takes them as that body.
    void move_bodies(Node& list) {
        const std::vector<std::string_view> keys = station_keys().names();
        std::vector<Entry> kept;
        for (Entry& entry : list.entries) {
            Entry* name = kept.empty() ? nullptr : &kept.back();
            const bool open = name != nullptr &&
                              (name->value.kind == Node::Kind::null || opened_.contains(name->key));
            if (!open || std::ranges::find(keys, entry.key) == keys.end()) {
                kept.push_back(std::move(entry));
                continue;
            }
            loading_.problems.add(entry.mark, "'" + entry.key + "' must be indented deeper than '" +
                                                  name->key + "' (line " +
                                                  std::to_string(name->mark.line) +
                                                  "), whose body it is: type 2 blanks before it");
            opened_.insert(name->key);
            name->value.kind = Node::Kind::map;
            name->value.entries.push_back(std::move(entry));
        }
        list.entries = std::move(kept);
    }

    void read_one(Entry& entry) {
        if (!is_name(entry.key))
            loading_.problems.add(entry.mark,
                                  "the name of a template must be of a-z, 0-9 and '-', "
                                  "not '" +
                                      entry.key + '\'');
        Node& body = entry.value;
        if (body.kind != Node::Kind::map)
            loading_.problems.add(body.mark,
                                  "a template must be a map of a station's keys, such as "
                                  "{profile: generic}");
        for (const std::string_view own : {"id", "name", "template"}) {
            const auto key = std::ranges::find(body.entries, own, &Entry::key);
            if (key == body.entries.end()) continue;
            loading_.problems.add(
                key->mark,
                "'" + std::string(own) + "' is a station's own: it cannot be in a template");
            body.entries.erase(key);
        }
        const yaml::Size size = yaml::size_of(body);
        templates_[entry.key] = {entry.mark, std::move(body), size, false};
    }

    std::string unknown(const std::string& typed) const {
        const std::string text = "there is no template '" + typed + '\'';
        if (templates_.empty())
            return text + "; add 'templates', such as templates: {" + typed +
                   ": {profile: generic}}";
        std::vector<std::string_view> names;
        for (const auto& [name, one] : templates_) names.push_back(name);
        return text + did_you_mean(typed, names, "templates");
    }

    Loading& loading_;
    std::map<std::string, Template> templates_;
    yaml::Size given_;
    std::set<std::string> opened_;  ///< names whose bodies are not indented
};

}  // namespace

std::vector<Node> apply_templates(Loading& loading, Node& tree) {
    Templates templates(loading);
    if (auto list = take(tree, "templates")) templates.read(*list);
    Node* lines = tree.find("lines");
    for_stations(lines, [&](Node& station) { templates.apply(station); });
    return templates.take_unused(lines);
}

}  // namespace panelgate::config
