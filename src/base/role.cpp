#include "panelgate/base/role.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace panelgate {

namespace {

constexpr std::array kRoles{Role::viewer, Role::operator_, Role::engineer, Role::admin};

/// The least default role that has it.
constexpr Role least_with(Right right) {
    switch (right) {
        case Right::read:
            return Role::viewer;
        case Right::write:
        case Right::acknowledge:
            return Role::operator_;
        case Right::broadcast:
        case Right::raw:
        case Right::discover:
        case Right::simulator:
            return Role::engineer;
        case Right::reload:
        case Right::configure:
            return Role::admin;
    }
    std::abort();
}

}  // namespace

std::string_view label(Role role) {
    switch (role) {
        case Role::none:
            return "none";
        case Role::viewer:
            return "viewer";
        case Role::operator_:
            return "operator";
        case Role::engineer:
            return "engineer";
        case Role::admin:
            return "admin";
    }
    std::abort();
}

std::string_view label(Right right) {
    switch (right) {
        case Right::read:
            return "read";
        case Right::write:
            return "write";
        case Right::broadcast:
            return "broadcast";
        case Right::raw:
            return "raw";
        case Right::discover:
            return "discover";
        case Right::simulator:
            return "simulator";
        case Right::reload:
            return "reload";
        case Right::acknowledge:
            return "acknowledge";
        case Right::configure:
            return "configure";
    }
    std::abort();
}

Rights rights_of(Role role) {
    Rights rights;
    for (const Right right : kAllRights)
        if (least_with(right) <= role) rights.add(right);
    return rights;
}

Role least_with(const Rights& rights) {
    Role least = Role::none;
    for (const Right right : kAllRights)
        if (rights.has(right)) least = std::max(least, least_with(right));
    return least;
}

Standing::Standing(Role of, std::optional<OwnRole> own_role) : role(of), own(std::move(own_role)) {}

bool Standing::exceeds(const Standing& other) const {
    return std::ranges::any_of(kAllRights,
                               [&](Right right) { return may(right) && !other.may(right); });
}

Standing only_reading(const Standing& anonymous) {
    if (!anonymous.may(Right::read)) return {};
    return anonymous.exceeds(Role::viewer) ? Standing(Role::viewer) : anonymous;
}

bool Standing::may(Right right) const {
    return own ? own->rights.has(right) : least_with(right) <= role;
}

Standing standing_named(std::string_view word, std::span<const OwnRole> own) {
    if (const auto known = std::ranges::find(own, word, &OwnRole::name); known != own.end())
        return {least_with(known->rights), *known};
    const auto role = std::ranges::find(kRoles, word, [](Role one) { return label(one); });
    return {role == kRoles.end() ? Role::none : *role, {}};
}

}  // namespace panelgate
