#include "load_roles.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/access/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::MapReader;
using yaml::Node;

constexpr std::array<std::string_view, 4> kDefaultRoles{"viewer", "operator", "engineer", "admin"};
constexpr std::string_view kRolePattern = "^[a-z0-9-]+$";
constexpr std::string_view kRoleExample = "{name: setter, rights: [read, write]}";

void load_rights(Loading& loading, MapReader& in, OwnRole& role) {
    std::vector<std::string_view> words;
    for (const Right right : kAllRights) words.push_back(label(right));
    const Node* list = in.sequence("rights", "[read, write]");
    in.looks_like_one_of("rights", words);
    yaml::KeyShape& schema = in.schema("rights");
    schema.fewest = 1;
    schema.required = true;
    schema.may_be_null = false;
    if (list == nullptr || list->items.empty()) {
        in.problem(list == nullptr ? "name" : "rights",
                   "a role needs rights, such as rights: [read, write]");
        return;
    }
    for (const Node& item : list->items) {
        const auto known = std::ranges::find(kAllRights, item.scalar,
                                             [](Right right) { return std::string(label(right)); });
        if (item.kind == Node::Kind::scalar && known != kAllRights.end()) {
            role.rights.add(*known);
        } else {
            loading.problems.add(item.mark, yaml::no_such("right", item.scalar, words));
        }
    }
}

void load_own_role(Loading& loading, const Node& node) {
    MapReader in(node, loading.problems, "a role", kRoleExample);
    OwnRole role;
    role.name = load_unique_name(loading, in, "role");
    const bool is_taken =
        role.name == "none" || role.name == "default" ||
        std::ranges::find(kDefaultRoles, std::string_view(role.name)) != kDefaultRoles.end();
    if (is_taken)
        in.problem("name", "the role '" + role.name + "' is there already; give it another name");
    load_rights(loading, in, role);
    own_role_keys().read(in, role);
    in.finish();
    if (!is_taken && !role.name.empty()) loading.config.access.roles.push_back(std::move(role));
}

}  // namespace

void load_own_roles(Loading& loading, MapReader& root) {
    const Node* node = root.child("access");
    if (node == nullptr || node->kind != Node::Kind::map) return;
    MapReader in(*node, loading.problems, "access");
    const Node* list = in.child("roles");
    // load_rules() says what is wrong with the list.
    const bool is_list = list != nullptr && list->kind == Node::Kind::sequence;
    if (!is_list || list->items.size() > access::Settings::kMaxRoles) return;
    // So that the schema has the keys of a role.
    root.map("access", kRoleExample);
    in.sequence("roles", kRoleExample);
    for (const Node& item : list->items) load_own_role(loading, item);
}

std::vector<std::string_view> role_words(const Config& config) {
    std::vector<std::string_view> words(kDefaultRoles.begin(), kDefaultRoles.end());
    for (const OwnRole& role : config.access.roles) words.push_back(role.name);
    return words;
}

bool is_role(const Config& config, std::string_view word) {
    const std::vector<std::string_view> words = role_words(config);
    return std::ranges::find(words, word) != words.end();
}

std::optional<Standing> load_role(Loading& loading, MapReader& in, std::string_view key,
                                  bool none) {
    std::vector<std::string_view> words = role_words(loading.config);
    if (none) words.insert(words.begin(), "none");
    const auto found = in.choice_index(key, words);
    // A schema knows no file, so it takes any name for a role.
    yaml::KeyShape& shape = in.schema(key);
    shape.kind = yaml::KeyShape::Kind::text;
    shape.words.clear();
    in.looks_like(key, kRolePattern);
    if (!found) return std::nullopt;
    return standing_named(words[*found], loading.config.access.roles);
}

}  // namespace panelgate::config
